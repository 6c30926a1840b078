// Records what passes from a source to the pipeline.
#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "daemon/recorder/recording.hpp"
#include "driver/packet_source.hpp"

namespace dlod::daemon {

/// Hands on another source's batches, and copies to the recording while there is one.
class RecordingSource final : public driver::PacketSource {
  public:
    /// `source` must outlive this. `metadata` is the sensor's, as it came.
    RecordingSource(driver::PacketSource& source, const RecordingConfig& config, std::string metadata);

    /// Ends the recording, and begins a new one where the configuration names a folder. From any thread.
    void configure(const RecordingConfig& config);

    driver::PacketBatch next() override;
    void stop() noexcept override { source_.stop(); }
    /// The source's and the recording's own; from any thread.
    void visit_counters(const driver::CounterVisitor& visit) const override;

  private:
    driver::PacketSource& source_;
    std::string metadata_;
    mutable std::mutex mutex_;  ///< held while a batch is copied: nobody else holds it for longer than a moment
    std::unique_ptr<Recording> recording_;
};

}  // namespace dlod::daemon
