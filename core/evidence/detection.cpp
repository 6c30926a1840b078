#include "core/evidence/detection.hpp"

#include "core/evidence/detection_shape.hpp"

namespace dlod {

struct Detector::State {
    State(const SensorModel& sensor, const DetectionConfig& c)
        : config(c), residuals(sensor), row_ends(2 * static_cast<std::size_t>(sensor.height)) {}

    void add(Frame& frame, std::span<const PixelIndex> pixels);

    DetectionConfig config;
    ResidualImage residuals;
    std::vector<int> row_ends;
};

void Detector::State::add(Frame& frame, std::span<const PixelIndex> pixels) {
    DetectionResult& result = frame.detection;
    Detection& detection = result.detections.emplace_back();
    detection.first = static_cast<std::uint32_t>(result.pixels.size());
    detection.count = static_cast<std::uint32_t>(pixels.size());
    result.pixels.insert(result.pixels.end(), pixels.begin(), pixels.end());
    measure_shape(pixels, frame.odometry, detection);
    mark_occlusion(pixels, frame.cloud.range_m, config.occlusion_step_m, row_ends, detection);
    if (config.use_residual) {
        const AverageResidual residual = average_residual(pixels, residuals.image());
        detection.average_residual_m = residual.mean_m;
        detection.residual_points = residual.count;
    }
}

Detector::Detector(const SensorModel& sensor, const DetectionConfig& config)
    : state_(std::make_unique<State>(sensor, config)) {}
Detector::~Detector() = default;

void Detector::process(Frame& frame) {
    State& state = *state_;
    frame.detection.pixels.clear();
    frame.detection.detections.clear();
    state.residuals.update(frame.odometry);
    if (!frame.odometry.valid) return;
    for (const Segment& segment : frame.prepared.segments) {
        if (!segment.feasible || static_cast<double>(segment.max_range_m) > state.config.max_range_m) continue;
        state.add(frame, std::span(frame.prepared.pixels).subspan(segment.first, segment.count));
    }
}

const Image<float>& Detector::residual_image() const {
    return state_->residuals.image();
}

}  // namespace dlod
