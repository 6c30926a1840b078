// Completes the mask of an object whose core has been found: fringes that segmentation left over, and the feet that
// ground removal took.
#pragma once

#include <vector>

#include "core/evidence/evidence_image.hpp"
#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct CompletionConfig {
    double fringe_m = 0.4;
    double foot_height_m = 0.015;
    double max_foot_height_m = 0.35;

    template <class V>
    void visit(V& v) {
        v.parameter("fringe_m", fringe_m, Range{0.0, 2.0}, "m",
                    "loose pixels join an object within this distance of its pixels; 0: never");
        v.parameter("foot_height_m", foot_height_m, Range{0.0, 0.5}, "m",
                    "pixels taken for ground that stand higher above the plane of the ground around join the object; "
                    "higher leaves more feet out");
        v.parameter("max_foot_height_m", max_foot_height_m, Range{0.0, 1.0}, "m", "but not higher than this");
    }
};

class Completion {
  public:
    Completion(const SensorModel& sensor, const CompletionConfig& config);

    /// Starts a frame: no pixel is taken.
    void begin() { taken_.fill(0); }
    /// Marks pixels as belonging to a detection.
    void take(std::span<const PixelIndex> pixels) {
        for (const PixelIndex pixel : pixels) taken_[pixel] = 1;
    }
    /// Appends the missing pixels of a detection to `pixels`, which holds its own from `first` to the end, and takes
    /// them.
    void complete(const Frame& frame, const EvidenceImage& evidence, std::size_t first,
                  std::vector<PixelIndex>& pixels);

  private:
    /// z = height[0] x + height[1] y + height[2], world axes about the detection's first point.
    struct GroundPlane {
        Eigen::Vector3d origin = Eigen::Vector3d::Zero();
        Eigen::Vector3d coefficients = Eigen::Vector3d::Zero();
        bool found = false;
    };

    Eigen::Vector3d world_point(const Frame& frame, PixelIndex pixel) const;
    GroundPlane fit_ground(const Frame& frame, std::span<const PixelIndex> pixels);
    template <class Accept>
    void grow(const Frame& frame, std::size_t first, double reach_m, std::vector<PixelIndex>& pixels, Accept accept);

    SensorModel sensor_;
    CompletionConfig config_;
    Image<std::uint8_t> taken_;
    std::vector<float> away_m_;
    std::vector<Eigen::Vector3d> ground_points_;
};

}  // namespace dlod
