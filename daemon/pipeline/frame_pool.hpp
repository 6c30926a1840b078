#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "daemon/pipeline/stage.hpp"

namespace dlod::daemon {

/// All frames of a pipeline, allocated at its start. Frames come back to it by two ways, each with one producer. The
/// one that came back last is the next to be given out: its memory is still in the cache.
class FramePool {
  public:
    FramePool(const SensorModel& sensor, std::size_t size) : finished_(size), dropped_(size) {
        free_.reserve(size);
        for (std::size_t i = 0; i < size; ++i) {
            frames_.push_back(std::make_unique<PipelineFrame>(sensor));
            free_.push_back(frames_.back().get());
        }
        free_count_ = size;
    }

    /// Where the last stage puts a frame.
    FrameQueue& finished() { return finished_; }
    /// Where the first stage puts a frame that it dropped.
    FrameQueue& dropped() { return dropped_; }

    /// For one thread. @return nullptr where none is free
    PipelineFrame* acquire() {
        dropped_.consume_all([this](PipelineFrame* frame) { free_.push_back(frame); });
        finished_.consume_all([this](PipelineFrame* frame) { free_.push_back(frame); });
        PipelineFrame* frame = nullptr;
        if (!free_.empty()) {
            frame = free_.back();
            free_.pop_back();
        }
        free_count_.store(free_.size());
        return frame;
    }
    /// For the thread that acquires: at least so many are free. Others get an estimate.
    std::size_t available() const {
        return free_count_.load() + finished_.read_available() + dropped_.read_available();
    }
    std::size_t size() const { return frames_.size(); }

  private:
    std::vector<std::unique_ptr<PipelineFrame>> frames_;
    std::vector<PipelineFrame*> free_;  ///< a stack, of the thread that acquires
    std::atomic<std::size_t> free_count_{0};
    FrameQueue finished_;
    FrameQueue dropped_;
};

}  // namespace dlod::daemon
