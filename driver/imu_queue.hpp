// IMU samples on their way into frames.
#pragma once

#include <cstdint>
#include <vector>

#include "core/types/imu_sample.hpp"

namespace dlod::driver {

/// Keeps samples in time order until the frame is closed whose stamp they precede. Bounded: the oldest go first.
class ImuQueue {
  public:
    static constexpr std::size_t kCapacity = 256;

    ImuQueue() { samples_.reserve(kCapacity); }

    /// Returns the number of samples that were thrown away: this one when its time is already there, or the oldest.
    std::uint64_t push(const ImuSample& sample);

    /// Moves the samples up to `stamp_ns` to `out`, which is cleared first. Throws away and counts those that no clock
    /// explains: over a second beyond the stamp, or over kHistory before it.
    std::uint64_t take(std::int64_t stamp_ns, std::vector<ImuSample>& out);

    void clear() { samples_.clear(); }

  private:
    static constexpr std::int64_t kFuture_ns = 1'000'000'000;
    static constexpr std::int64_t kHistory_ns = 5'000'000'000;

    std::vector<ImuSample> samples_;  ///< ordered by time
};

}  // namespace dlod::driver
