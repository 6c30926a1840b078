// A bounded series of capture files, the oldest of which give way.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>

#include "driver/counter.hpp"
#include "driver/pcap_writer.hpp"

namespace dlod::driver {

struct RotationOptions {
    std::filesystem::path folder = {};
    std::string prefix = "dlod";
    std::uint64_t file_bytes = 1'000'000'000;  ///< a file is closed before it grows beyond this; 1 MiB at least
    int files = 10;                            ///< kept at most, those of earlier runs included
    std::int64_t retry_ns = 10'000'000'000;    ///< in packet time, after a failure
    std::string metadata = {};                 ///< written beside each capture, so that it can be replayed by itself
    PcapWriterOptions writer = {};
};

/// Writes packets to PREFIX_NUMBER_TIME.pcap in a folder, each with the sensor's metadata in a .json of the same name,
/// and removes the oldest beyond the number to keep. The first packet after a failure (a full disk, say) that comes
/// `retry_ns` later opens a new file; files without packets are not left behind. Not thread-safe.
class CaptureRotation {
  public:
    explicit CaptureRotation(RotationOptions options);

    /// Makes the folder. Returns false if it cannot be written; error() then says why. The first packet tries again.
    bool prepare();

    /// Returns false if the packet was not written; error() then says why.
    bool write(const Packet& packet);

    /// Hands everything to the operating system.
    bool flush();

    const std::string& error() const { return error_; }  ///< of the last failure; empty again when it writes again
    const std::filesystem::path& file() const { return file_; }  ///< the one being written
    std::uint64_t files() const { return opened_.value(); }      ///< opened so far. From any thread.

  private:
    bool open(std::int64_t time_ns);
    bool fail(std::string error, std::int64_t time_ns);
    void remove_oldest(int keep);

    RotationOptions options_;
    std::unique_ptr<PcapWriter> writer_;
    std::filesystem::path file_;
    std::string error_;
    std::int64_t last_ns_ = 0;  ///< of the last packet that was tried
    Counter opened_;
};

}  // namespace dlod::driver
