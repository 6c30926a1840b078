#pragma once

#include <memory>
#include <vector>

#include "daemon/pipeline/stage.hpp"

namespace dlod::daemon {

/// All frames of a pipeline, allocated at its start. Frames come back to it by two ways, each with one producer.
class FramePool {
  public:
    FramePool(const SensorModel& sensor, std::size_t size) : finished_(size), dropped_(size) {
        for (std::size_t i = 0; i < size; ++i) {
            frames_.push_back(std::make_unique<PipelineFrame>(sensor));
            finished_.push(frames_.back().get());
        }
    }

    /// Where the last stage puts a frame.
    FrameQueue& finished() { return finished_; }
    /// Where the first stage puts a frame that it dropped.
    FrameQueue& dropped() { return dropped_; }

    /// For one thread. @return nullptr where none is free
    PipelineFrame* acquire() {
        PipelineFrame* frame = nullptr;
        if (!finished_.pop(frame)) dropped_.pop(frame);
        return frame;
    }
    std::size_t available() const { return finished_.read_available() + dropped_.read_available(); }
    std::size_t size() const { return frames_.size(); }

  private:
    std::vector<std::unique_ptr<PipelineFrame>> frames_;
    FrameQueue finished_;
    FrameQueue dropped_;
};

}  // namespace dlod::daemon
