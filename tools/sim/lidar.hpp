// What the lidar measures during a turn, and what is true of it.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/types/image.hpp"
#include "driver/metadata.hpp"
#include "tools/sim/random.hpp"
#include "tools/sim/ray_caster.hpp"

namespace dlod::tools::sim {

/// What tells product lines apart.
struct LidarOptics {
    double divergence_rad = 0.0061;  ///< full width of the beam
    double range_10_m = 35.0;        ///< at which a surface of 10 % is still seen
    double minimum_range_m = 0.3;
};

/// OS-0, OS-1 or OS-2 by the product line in the metadata, else OS-1.
LidarOptics optics_of(const std::string& product_line);

struct LidarOptions {
    std::uint64_t seed = 1;
    bool noise = true;   ///< false: exact ranges, no dropouts, beams without width
    bool rough = false;  ///< leaves let light through and flutter, beams are not quite calibrated, stray returns
    /// Single pulses are off from their pixel's direction by up to this, in azimuth and altitude.
    double off_grid_rad = 0.0;
};

/// One return of each pixel; destaggered images.
struct ReturnImages {
    Image<std::uint32_t> range_mm;  ///< as the profile can express it; 0: none
    Image<std::uint8_t> reflectivity;
    Image<std::uint16_t> signal;
};

/// A turn as measured, with its truth; destaggered images [H, W].
struct Scan {
    int index = 0;
    double start_s = 0.0;  ///< of column 0, since the drive's start
    ReturnImages first;    ///< the strongest
    ReturnImages second;
    Image<std::uint16_t> near_ir;
    Image<std::uint8_t> label;      ///< as in labels.bin
    Image<std::uint16_t> instance;  ///< object id
    Image<float> x, y, z;           ///< the measured point in the world, by its column's true pose
};

class Lidar {
  public:
    Lidar(const driver::SensorInfo& sensor, const World& world, double duration_s, const LidarOptions& options);

    const SensorModel& model() const { return sensor_.model; }
    double turn_s() const { return sensor_.model.frame_period_s; }
    double column_s(int measurement) const { return turn_s() * measurement / sensor_.model.width; }
    /// True where an actor moves at some time of the drive.
    bool ever_moves(std::size_t actor) const { return ever_moves_[actor]; }

    /// Scans turn `index`. `caster` must be of the same world; calls with different casters may run side by side.
    void scan(int index, RayCaster& caster, Scan& result) const;

  private:
    /// Rays that stand for a beam: its middle, and its rim.
    static constexpr int kSubRays = 4;
    struct Beam {
        std::array<Eigen::Vector3d, kSubRays> direction;  ///< in the lidar frame at encoder angle 0
    };
    struct Echo;
    Eigen::Vector3d off_grid(const Eigen::Vector3d& direction, int index, int measurement, int row) const;
    void pass_leaves(const RayCaster& caster, const RayBundle& rays, Random& random, Hit hits[kRaysPerCast]) const;
    void measure(const Hit* hits, Random& random, Echo& first, Echo& second) const;
    void scatter(Random& random, Echo& echo) const;

    driver::SensorInfo sensor_;
    const World& world_;
    LidarOptions options_;
    LidarOptics optics_;
    std::uint32_t range_step_mm_;
    std::uint32_t range_limit_mm_;
    int rays_a_beam_;
    std::vector<Beam> beams_;       ///< [H]
    std::vector<float> bias_m_;     ///< [H] what a beam's ranges are off by
    std::vector<bool> ever_moves_;  ///< [actors]
};

/// Speed from which something counts as moving, m/s.
inline constexpr double kMovingSpeed_mps = 0.1;

}  // namespace dlod::tools::sim
