#include "driver/paced_source.hpp"

#include <poll.h>

#include <chrono>

namespace dlod::driver {

PacedSource::PacedSource(std::unique_ptr<PacketSource> source, double rate)
    : source_(std::move(source)), clock_(rate) {}

void PacedSource::stop() noexcept {
    source_->stop();
    stop_.set();
}

PacketBatch PacedSource::next() {
    const PacketBatch batch = source_->next();
    for (std::string& warning : source_->take_warnings()) warn(std::move(warning));
    if (batch.status != SourceStatus::kPackets) return batch;

    const std::int64_t now_ns = std::chrono::steady_clock::now().time_since_epoch() / std::chrono::nanoseconds(1);
    const std::int64_t wait_ns = clock_.wait_ns(batch.packets.back().receive_ns, now_ns);
    if (wait_ns == 0) return batch;
    pollfd stop{.fd = stop_.fd(), .events = POLLIN, .revents = 0};
    const timespec timeout{.tv_sec = wait_ns / 1'000'000'000, .tv_nsec = wait_ns % 1'000'000'000};
    // A signal wakes it early: the packet comes a little early then, the next ones are on time again.
    if (::ppoll(&stop, 1, &timeout, nullptr) > 0) return {.status = SourceStatus::kStopped, .packets = {}};
    return batch;
}

}  // namespace dlod::driver
