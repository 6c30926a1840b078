#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <vector>

namespace dlod::tools::soak {

/// The true poses of one lap, which repeats for ever.
class TruthPath {
  public:
    /// @param file "stamp x y z qx qy qz qw" a line, one for each turn @throws std::runtime_error
    TruthPath(const std::filesystem::path& file, std::int64_t turn_ns);

    int frames() const { return static_cast<int>(poses_.size()); }
    /// T_world_sensor, interpolated between turns. @param stamp_us the sensor's time
    Eigen::Isometry3d at(std::int64_t stamp_us) const;

  private:
    std::vector<Eigen::Isometry3d> poses_;
    std::int64_t first_us_ = 0;
    double turn_us_;
};

}  // namespace dlod::tools::soak
