// From segments to detections: residuals, free-space evidence, and the pixels that belong together.
#pragma once

#include <memory>

#include "core/residuals/residual_image.hpp"
#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct DetectionConfig {
    bool use_residual = true;
    bool use_free_space = true;
    double max_range_m = 50.0;
    double occlusion_step_m = 0.3;

    template <class V>
    void visit(V& v) {
        v.flag("use_residual", use_residual, "cue: average registration residual of a segment (the paper's)");
        v.flag("use_free_space", use_free_space, "cue: a return where earlier frames saw free space");
        v.parameter("max_range_m", max_range_m, Range{1.0, 200.0}, "m", "objects farther away are not looked for");
        v.parameter("occlusion_step_m", occlusion_step_m, Range{0.05, 5.0}, "m",
                    "a neighbour nearer by more than this hides the detection's side");
    }
};

/// Fills frame.detection.pixels and .detections (without track) from frame.prepared and frame.odometry, and remembers
/// what was seen free. Frames in order.
class Detector {
  public:
    Detector(const SensorModel& sensor, const DetectionConfig& config);
    ~Detector();
    void process(Frame& frame);
    const Image<float>& residual_image() const;

  private:
    struct State;
    std::unique_ptr<State> state_;
};

}  // namespace dlod
