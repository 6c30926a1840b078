#include "daemon/pipeline/stage.hpp"

namespace dlod::daemon {

PipelineFrame* IntakeStage::drop_oldest() {
    PipelineFrame* frame = Stage::take();
    left_behind_.insert(left_behind_.end(), frame->imu.begin(), frame->imu.end());
    if (left_behind_.size() > kMostLeftBehind) {
        left_behind_.erase(left_behind_.begin(), left_behind_.end() - static_cast<std::ptrdiff_t>(kMostLeftBehind));
    }
    dropped_frames_.store(dropped_frames() + 1);
    return frame;
}

PipelineFrame* IntakeStage::take() {
    const std::int64_t now_ns = StepTimer::now_ns(CLOCK_MONOTONIC);
    const auto is_lost = [&] {
        return (max_waiting_ > 0 && in().read_available() > max_waiting_) ||
               admission_.too_late(now_ns - in().front()->received_ns);
    };
    while (in().read_available() > 0) {
        if (is_lost()) {
            dropped_.push(drop_oldest());
            continue;
        }
        PipelineFrame* frame = Stage::take();
        frame->imu.insert(frame->imu.begin(), left_behind_.begin(), left_behind_.end());
        left_behind_.clear();
        frame->admission = admission_.taken(now_ns);
        return frame;
    }
    return nullptr;
}

PipelineFrame* IntakeStage::steal() {
    if (!try_claim()) return nullptr;
    PipelineFrame* frame = in().read_available() > 0 ? drop_oldest() : nullptr;
    release();
    return frame;
}

}  // namespace dlod::daemon
