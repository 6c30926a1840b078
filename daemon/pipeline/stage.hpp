// A stage of the pipeline: takes frames from one queue, works on them, hands them to the next.
#pragma once

#include <boost/lockfree/spsc_queue.hpp>
#include <cstdint>
#include <functional>
#include <vector>

#include "daemon/pipeline/admission.hpp"
#include "daemon/pipeline/pipeline_frame.hpp"
#include "daemon/pipeline/worker_pool.hpp"

namespace dlod::daemon {

/// Frames on their way from one stage to the next. The claim of a stage makes its worker the single consumer of the
/// queue before it and the single producer of the queue behind it.
using FrameQueue = boost::lockfree::spsc_queue<PipelineFrame*>;

class Stage : public Actor {
  public:
    using Work = std::function<void(PipelineFrame&)>;
    using Condition = std::function<bool()>;

    /// @param may_start beyond a frame in `in` and room in `out`; nothing: always
    Stage(FrameQueue& in, FrameQueue& out, Work work, Condition may_start = {})
        : in_(in), out_(out), work_(std::move(work)), may_start_(std::move(may_start)) {}

    bool ready() const override {
        return in_.read_available() > 0 && out_.write_available() > 0 && (!may_start_ || may_start_());
    }
    void run() override {
        working_.store(true);
        if (PipelineFrame* frame = take(); frame != nullptr) {
            work_(*frame);
            // Counted before it is handed on: who sees the frame behind this stage sees the count, too.
            completed_.store(completed() + 1);
            out_.push(frame);
        }
        working_.store(false);
    }
    /// Frames worked on so far; what the stage did for them is visible to who reads it.
    std::uint64_t completed() const { return completed_.load(); }
    /// A frame waits for it or is at work.
    bool has_work() const { return working_.load() || in_.read_available() > 0; }

  protected:
    /// The next frame to work on, or nullptr where none of those in `in`, which has one, is to be worked on.
    virtual PipelineFrame* take() {
        PipelineFrame* frame = nullptr;
        in_.pop(frame);
        return frame;
    }
    FrameQueue& in() { return in_; }

  private:
    FrameQueue& in_;
    FrameQueue& out_;
    Work work_;
    Condition may_start_;
    std::atomic<std::uint64_t> completed_{0};
    std::atomic<bool> working_{false};
};

/// The first stage. Live, the newest frames win: where more are waiting than may, and where one would be published too
/// late, the oldest are dropped and counted.
class IntakeStage final : public Stage {
  public:
    /// @param dropped takes the frames that are dropped; as large as the pool
    /// @param max_waiting 0: nothing is ever dropped
    IntakeStage(FrameQueue& in, FrameQueue& out, FrameQueue& dropped, std::size_t max_waiting, Admission& admission,
                Work work)
        : Stage(in, out, std::move(work), [&admission] { return admission.open(); }),
          dropped_(dropped),
          max_waiting_(max_waiting),
          admission_(admission) {}

    /// For a thread that is not a worker and needs a frame at any price: takes the oldest one that waits.
    /// @return nullptr where none waits or the stage is at work
    PipelineFrame* steal();
    std::uint64_t dropped_frames() const { return dropped_frames_.load(); }

    /// Readings of the IMU that the next frame takes over from those dropped before it, at most: some seconds of them.
    /// Beyond, the newest ones, however long the stages behind hang.
    static constexpr std::size_t kMostLeftBehind = 1024;

  protected:
    PipelineFrame* take() override;

  private:
    PipelineFrame* drop_oldest();

    FrameQueue& dropped_;
    std::size_t max_waiting_;
    Admission& admission_;
    std::vector<ImuSample> left_behind_;  ///< samples of dropped frames: the odometry integrates the IMU without gaps
    std::atomic<std::uint64_t> dropped_frames_{0};
};

}  // namespace dlod::daemon
