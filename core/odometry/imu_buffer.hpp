// The last IMU samples, readable at any time.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "core/types/imu_sample.hpp"

namespace dlod {

/// Keeps the newest samples in time order. What is no number, out of order or beyond any sensor's range is left out,
/// and so is a single sample that stands out from both its neighbours as no body can move. When the IMU's clock is set
/// back it begins anew.
class ImuBuffer {
  public:
    /// What its clock and the lidar's may differ by.
    static constexpr double kClockOffset_s = 1e-3;

    struct Reading {
        Eigen::Vector3d angular_velocity_radps = Eigen::Vector3d::Zero();
        Eigen::Vector3d acceleration_mps2 = Eigen::Vector3d::Zero();
    };

    /// @return number of samples that were taken over
    int add(std::span<const ImuSample> samples);
    void clear();
    /// Mean angular velocity times time from one moment to another, rad.
    Eigen::Vector3d turn(std::int64_t from_ns, std::int64_t to_ns) const;
    bool empty() const { return count_ == 0; }
    std::int64_t newest_ns() const;
    std::int64_t oldest_ns() const;

    /// Linear between samples; before the first and after the last, that sample's. The buffer must not be empty.
    Reading at(std::int64_t time_ns) const;

    /// No sample is near this time.
    bool is_silent_at(std::int64_t time_ns) const;
    /// Mean angular velocity over the second that ends with the last sample before this time.
    Eigen::Vector3d mean_rate_before(std::int64_t time_ns) const;

  private:
    static constexpr std::size_t kCapacity = 512;
    struct Stored {
        std::int64_t stamp_ns;
        Reading reading;
    };
    const Stored& stored(std::size_t i) const { return samples_[(first_ + i) % kCapacity]; }
    void store(const Stored& sample);
    static double excess(const Reading& a, const Reading& b);

    std::array<Stored, kCapacity> samples_;
    std::size_t first_ = 0;
    std::size_t count_ = 0;
    std::optional<Stored> doubtful_;  ///< the newest sample, which stands out: a spike, or a shock
};

}  // namespace dlod
