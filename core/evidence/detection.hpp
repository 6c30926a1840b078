// From segments to detections: residuals, free-space evidence, and the pixels that belong together.
#pragma once

#include <memory>

#include "core/evidence/completion.hpp"
#include "core/evidence/framed_openings.hpp"
#include "core/evidence/free_space.hpp"
#include "core/evidence/moving_parts.hpp"
#include "core/evidence/turned_plates.hpp"
#include "core/residuals/residual_image.hpp"
#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct DetectionConfig {
    bool use_residual = true;
    bool use_free_space = true;
    bool use_plates = true;
    double max_range_m = 50.0;
    double occlusion_step_m = 0.3;
    int samples = 80;
    int background_stride = 12;
    double mixed_share = 0.25;
    double compact_m = 1.2;
    FreeSpaceConfig free_space;
    FramedOpeningsConfig openings;
    MovingPartsConfig parts;
    TurnedPlatesConfig plates;
    CompletionConfig completion;

    template <class V>
    void visit(V& v) {
        v.flag("use_residual", use_residual, "cue: average registration residual of a segment (the paper's)");
        v.flag("use_free_space", use_free_space, "cue: a return where earlier frames saw free space");
        v.flag("use_plates", use_plates, "and a plane that has turned, as doors do");
        v.parameter("max_range_m", max_range_m, Range{1.0, 200.0}, "m", "objects farther away are not looked for");
        v.parameter("occlusion_step_m", occlusion_step_m, Range{0.05, 5.0}, "m",
                    "a neighbour nearer by more than this hides the detection's side");
        v.parameter("samples", samples, Range{10, 100000}, "pixels",
                    "pixels of a feasible segment that are tested for free space; higher is slower");
        v.parameter(
            "background_stride", background_stride, Range{1, 64}, "pixels",
            "of segments that are no objects every n-th pixel is tested; higher is faster, finds less at walls");
        v.parameter("mixed_share", mixed_share, Range{0.0, 1.0}, "1",
                    "a segment of which this share of the evidence says occupied, and the rest free, is divided");
        v.parameter("compact_m", compact_m, Range{0.0, 10.0}, "m",
                    "segments no wider than this are divided only where most of the evidence says occupied");
        v.group("free_space", free_space, "comparison with earlier frames");
        v.group("openings", openings, "windows of what stands");
        v.group("parts", parts, "moving parts of segments");
        v.group("plates", plates, "doors, gates and other plates that turn");
        v.group("completion", completion, "pixels at the edges and feet of objects");
    }
};

/// Fills frame.detection.pixels and .detections (pixels, residual, evidence, occlusion; their shapes are the tracker's)
/// from frame.prepared and frame.odometry, and remembers what was seen free. Frames in order.
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
