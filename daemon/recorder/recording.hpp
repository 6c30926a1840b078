// Packets to rotating capture files, without holding up who receives them.
#pragma once

#include <atomic>
#include <boost/lockfree/spsc_queue.hpp>
#include <condition_variable>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "daemon/recorder/recording_config.hpp"
#include "driver/capture_rotation.hpp"
#include "driver/counter.hpp"
#include "driver/packet.hpp"

namespace dlod::daemon {

/// Copies packets to a thread that writes them to disk. The copy is all that it costs the caller: when the disk is too
/// slow or full, packets are missing from the recording, counted and reported.
class Recording {
  public:
    /// `metadata` is the sensor's, as it came.
    Recording(const RecordingConfig& config, const std::string& metadata);
    /// Writes what still waits, then closes the file.
    ~Recording();
    Recording(const Recording&) = delete;
    Recording& operator=(const Recording&) = delete;

    /// For one thread.
    void add(const driver::Packet& packet);
    /// For the operator, each said once. For the thread that calls add().
    std::vector<std::string> take_warnings();
    /// From any thread.
    void visit_counters(const driver::CounterVisitor& visit) const;

  private:
    struct Header {
        std::int64_t receive_ns = 0;
        driver::IpAddress sender_address{};
        std::uint16_t sender_port = 0;
        std::uint16_t destination_port = 0;
        std::uint32_t bytes = 0;
    };

    void write_until_stopped();
    void write_waiting();
    void report_trouble();

    driver::Counter recorded_;
    driver::Counter buffer_full_;
    driver::Counter write_failed_;

    // The writing thread's.
    driver::CaptureRotation rotation_;
    std::vector<std::byte> datagram_;
    std::optional<Header> header_;  // taken from the queue, its bytes not yet
    bool in_trouble_ = false;

    // Between the threads.
    boost::lockfree::spsc_queue<std::byte> waiting_;
    std::mutex mutex_;
    std::condition_variable stop_requested_;
    bool stopping_ = false;
    std::string message_;
    std::atomic<bool> message_waits_{false};
    std::vector<std::string> warnings_;  // of the thread that adds
    std::thread writer_;
};

}  // namespace dlod::daemon
