#include "daemon/recorder/recording.hpp"

#include <chrono>
#include <span>
#include <utility>

namespace dlod::daemon {
namespace {

constexpr auto kWritePeriod = std::chrono::milliseconds(50);
constexpr int kFlushEvery = 20;  ///< write periods: at most a second is lost when the power goes

constexpr std::size_t kLargestDatagram = 65536;

driver::RotationOptions rotation_options(const RecordingConfig& config, const std::string& metadata) {
    driver::RotationOptions options;
    options.folder = config.folder;
    options.file_bytes = static_cast<std::uint64_t>(config.file_megabytes) * 1'000'000;
    options.files = config.files;
    options.metadata = metadata;
    return options;
}

}  // namespace

Recording::Recording(const RecordingConfig& config, const std::string& metadata)
    : rotation_(rotation_options(config, metadata)),
      datagram_(kLargestDatagram),
      waiting_(static_cast<std::size_t>(config.buffer_megabytes) * 1'000'000),
      writer_([this] { write_until_stopped(); }) {}

Recording::~Recording() {
    {
        const std::lock_guard lock(mutex_);
        stopping_ = true;
    }
    stop_requested_.notify_one();
    writer_.join();
}

std::vector<std::string> Recording::take_warnings() {
    if (message_waits_.exchange(false)) {
        const std::lock_guard lock(mutex_);
        warnings_.push_back(std::exchange(message_, {}));
    }
    return std::exchange(warnings_, {});
}

void Recording::add(const driver::Packet& packet) {
    const Header header{.receive_ns = packet.receive_ns,
                        .sender_address = packet.sender_address,
                        .sender_port = packet.sender_port,
                        .destination_port = packet.destination_port,
                        .bytes = static_cast<std::uint32_t>(packet.data.size())};
    if (waiting_.write_available() < sizeof header + packet.data.size()) {
        if (buffer_full_.value() == 0) {
            warnings_.emplace_back("recording: the disk is too slow, packets are missing from the recording");
        }
        ++buffer_full_;
        return;
    }
    const auto bytes = std::as_bytes(std::span(&header, 1));
    waiting_.push(bytes.data(), bytes.size());
    waiting_.push(packet.data.data(), packet.data.size());
}

void Recording::write_until_stopped() {
    // A folder that cannot be used is named at the start, not when the sensor comes.
    rotation_.prepare();
    report_trouble();
    // What was queued before the stop was requested is written: the request is seen first, the queue emptied after it.
    bool stopping = false;
    for (int period = 1; !stopping; ++period) {
        {
            std::unique_lock lock(mutex_);
            stop_requested_.wait_for(lock, kWritePeriod, [this] { return stopping_; });
            stopping = stopping_;
        }
        write_waiting();
        if (stopping || period % kFlushEvery == 0) rotation_.flush();
        report_trouble();
    }
}

void Recording::write_waiting() {
    for (;;) {
        if (!header_) {
            Header header;
            if (waiting_.read_available() < sizeof header) return;
            waiting_.pop(reinterpret_cast<std::byte*>(&header), sizeof header);
            header_ = header;
        }
        if (waiting_.read_available() < header_->bytes) return;  // they follow the header at once
        const auto datagram = std::span(datagram_).first(header_->bytes);
        waiting_.pop(datagram.data(), datagram.size());
        const bool written = rotation_.write({.data = datagram,
                                              .receive_ns = header_->receive_ns,
                                              .sender_address = header_->sender_address,
                                              .sender_port = header_->sender_port,
                                              .destination_port = header_->destination_port});
        ++(written ? recorded_ : write_failed_);
        header_.reset();
    }
}

void Recording::report_trouble() {
    const bool trouble = !rotation_.error().empty();
    if (trouble == in_trouble_) return;
    in_trouble_ = trouble;
    const std::lock_guard lock(mutex_);
    message_ = trouble ? "recording: " + rotation_.error() + "; tried again every few seconds"
                       : "recording: goes on in " + rotation_.file().string();
    message_waits_.store(true);
}

void Recording::visit_counters(const driver::CounterVisitor& visit) const {
    visit("recorded_packets", recorded_.value());
    visit("recorded_files", rotation_.files());
    visit("recording_buffer_full", buffer_full_.value());
    visit("recording_write_failed", write_failed_.value());
}

}  // namespace dlod::daemon
