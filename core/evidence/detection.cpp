#include "core/evidence/detection.hpp"

namespace dlod {

struct Detector::State {
    ResidualImage residuals;
};

Detector::Detector(const SensorModel& sensor, const DetectionConfig&)
    : state_(std::make_unique<State>(State{ResidualImage(sensor)})) {}
Detector::~Detector() = default;

void Detector::process(Frame& frame) {
    state_->residuals.update(frame.odometry);
    frame.detection.pixels.clear();
    frame.detection.detections.clear();
}

const Image<float>& Detector::residual_image() const { return state_->residuals.image(); }

}  // namespace dlod
