#include "daemon/pipeline/stage.hpp"

namespace dlod::daemon {

PipelineFrame* IntakeStage::drop_oldest() {
    PipelineFrame* frame = Stage::take();
    // The odometry integrates the IMU without gaps: the samples go on with the next frame.
    if (in().read_available() > 0) {
        auto& next = in().front()->imu;
        next.insert(next.begin(), frame->imu.begin(), frame->imu.end());
    }
    dropped_frames_.store(dropped_frames() + 1);
    return frame;
}

PipelineFrame* IntakeStage::take() {
    while (max_waiting_ > 0 && in().read_available() > max_waiting_) dropped_.push(drop_oldest());
    return Stage::take();
}

PipelineFrame* IntakeStage::steal() {
    if (!try_claim()) return nullptr;
    // One stays: the samples of the dropped one need a next.
    PipelineFrame* frame = in().read_available() > 1 ? drop_oldest() : nullptr;
    release();
    return frame;
}

}  // namespace dlod::daemon
