#include "daemon/recorder/recording_source.hpp"

#include <utility>

namespace dlod::daemon {

RecordingSource::RecordingSource(driver::PacketSource& source, const RecordingConfig& config, std::string metadata)
    : source_(source), metadata_(std::move(metadata)) {
    configure(config);
}

void RecordingSource::configure(const RecordingConfig& config) {
    // The old one ends, which takes its time, and the new one is made while packets pass.
    std::unique_ptr<Recording> other;
    const auto exchange = [&] {
        const std::lock_guard lock(mutex_);
        std::swap(recording_, other);
    };
    exchange();
    other.reset();
    if (config.folder.empty()) return;
    other = std::make_unique<Recording>(config, metadata_);
    exchange();
}

driver::PacketBatch RecordingSource::next() {
    const driver::PacketBatch batch = source_.next();
    for (std::string& warning : source_.take_warnings()) warn(std::move(warning));
    const std::lock_guard lock(mutex_);
    if (!recording_) return batch;
    for (const driver::Packet& packet : batch.packets) recording_->add(packet);
    for (std::string& warning : recording_->take_warnings()) warn(std::move(warning));
    return batch;
}

void RecordingSource::visit_counters(const driver::CounterVisitor& visit) const {
    source_.visit_counters(visit);
    const std::lock_guard lock(mutex_);
    if (recording_) recording_->visit_counters(visit);
}

}  // namespace dlod::daemon
