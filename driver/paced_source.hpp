// A capture replayed at the rate at which it was recorded, or a multiple of it.
#pragma once

#include <memory>

#include "driver/packet_source.hpp"
#include "driver/replay_clock.hpp"
#include "driver/stop_event.hpp"

namespace dlod::driver {

/// Hands on another source's batches, each when the last of its packets is due. Sleeps meanwhile; stop() ends the
/// sleep.
class PacedSource final : public PacketSource {
  public:
    /// `rate` as for ReplayClock: 1 true rate, 0 as fast as possible.
    PacedSource(std::unique_ptr<PacketSource> source, double rate);

    PacketBatch next() override;
    void stop() noexcept override;
    void visit_counters(const CounterVisitor& visit) const override { source_->visit_counters(visit); }

    const PacketSource& source() const { return *source_; }

  private:
    std::unique_ptr<PacketSource> source_;
    ReplayClock clock_;
    StopEvent stop_;
};

}  // namespace dlod::driver
