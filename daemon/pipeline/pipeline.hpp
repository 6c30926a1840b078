// From packets to published, mapped and written results: the stages on a pool of threads.
//
//   ingest -> prepare -> odometry, publish pose -> detect and track -> publish -> map -> write
//
// Each stage works on one frame at a time and sees the frames in order; different stages work on different frames side
// by side. The feedback of the n-th frame reaches the odometry of frame n + kFeedbackDelay: the odometry waits for it,
// and never takes an older or a newer one. So the results depend on nothing but the frames.
#pragma once

#include <array>
#include <atomic>
#include <functional>
#include <thread>
#include <vector>

#include "core/dynamic_lidar_odometry.hpp"
#include "daemon/pipeline/frame_pool.hpp"
#include "daemon/pipeline/ingest.hpp"
#include "daemon/pipeline/stage.hpp"
#include "driver/body_filter.hpp"
#include "driver/geometry.hpp"

namespace dlod::daemon {

/// What becomes of a frame's results. Each is called on some worker, for one frame at a time, in order; what it throws
/// ends the pipeline (Pipeline::rethrow_failure). An empty one is skipped.
struct FrameSinks {
    /// Each reading of the IMU, where packets are received in time (live, paced), on the thread that receives. Must not
    /// throw.
    std::function<void(const ImuSample&)> imu;
    std::function<void(PipelineFrame&)> publish_pose;  ///< as soon as the pose is known
    std::function<void(PipelineFrame&)> publish;       ///< when all else is
    std::function<void(PipelineFrame&)> write;
    std::function<void(const PipelineFrame&)> finished;  ///< after all others, with all times known
};

struct PipelineOptions {
    int threads = 2;
    int waiting_frames = 2;  ///< live: more than these are dropped, oldest first; so are those that would be late
    double most_latency_turns = 2.0;  ///< live: a pose older than so many turns of the sensor is of no use to a
                                      ///< planner; 0: no frame is left out for being late
    bool live = false;                ///< receive on a thread of its own, never wait for the stages
    bool paced = false;               ///< replay in time: the source waits for packets, on a thread of its own
    driver::BodyFilter body = {};     ///< of the robot itself
    std::function<void(int)> on_thread_start = {};  ///< on each thread, with its number; the last one receives
};

class Pipeline {
  public:
    /// Allocates everything; start() sets it going.
    Pipeline(const driver::SensorInfo& sensor, const MethodConfig& method, const driver::FrameBuilderConfig& frames,
             driver::PacketSource& source, FrameSinks sinks, PipelineOptions options);
    /// Ends at once, whatever is on its way.
    ~Pipeline();

    void start();
    /// Ends the source; what has been received is processed to the end.
    void stop() { source_.stop(); }
    /// Becomes readable once the pipeline is done or has failed.
    int done_descriptor() const { return done_descriptor_; }
    bool done() const;
    /// False where a stage has had a frame to work on since the call before and has not finished any, or the source has
    /// not come back. For one thread, called once a second or less often.
    bool moves_on();
    /// Throws what a sink has thrown, if so.
    void rethrow_failure() const;

    /// After done().
    GlobalMap& map() { return method_.map(); }
    /// The map as it is now, to be put in order by CellTable::sorted. From any thread, at any time; frames are held up
    /// for no longer than the copy takes.
    std::vector<CellTable::Entry> map_snapshot();
    /// Pose, maps and tracks begin anew with the next frame that is prepared. From any thread.
    void request_restart() { restart_requested_.store(true); }
    /// Restarts that have gone through all stages. From any thread.
    std::uint64_t restarts() const { return restarts_.load(); }

    const Ingest& ingest() const { return ingest_; }
    std::uint64_t finished_frames() const { return write_.completed(); }
    std::uint64_t dropped_frames() const { return prepare_.dropped_frames(); }

  private:
    void prepare(PipelineFrame& frame);
    void estimate_pose(PipelineFrame& frame);
    void detect_and_track(PipelineFrame& frame);
    void publish(PipelineFrame& frame);
    void update_map(PipelineFrame& frame);
    void write(PipelineFrame& frame);
    static float latency_ms(const PipelineFrame& frame);
    void signal_if_done();
    bool receives_on_own_thread() const { return options_.live || options_.paced; }
    std::vector<Actor*> actors();

    driver::Geometry geometry_;
    DynamicLidarOdometry method_;
    driver::PacketSource& source_;
    FrameSinks sinks_;
    PipelineOptions options_;
    int done_descriptor_;
    EventCount events_;
    std::array<OdometryFeedback, kFeedbackDelay> feedback_;  ///< of frame n at n % kFeedbackDelay
    std::atomic<bool> restart_requested_{false};
    std::atomic<std::uint64_t> restarts_{0};

    Admission admission_;
    FramePool pool_;
    FrameQueue to_prepare_;
    FrameQueue to_odometry_;
    FrameQueue to_detection_;
    FrameQueue to_publish_;
    FrameQueue to_map_;
    FrameQueue to_write_;
    IntakeStage prepare_;
    Stage odometry_;
    Stage detection_;
    Stage publish_;
    Stage map_;
    Stage write_;
    Ingest ingest_;

    /// What moves_on() saw of each stage and of the ingest.
    struct Progress {
        std::uint64_t completed = 0;
        bool had_work = false;
    };
    std::array<Progress, 6> progress_{};
    std::uint64_t ingest_steps_ = 0;

    WorkerPool workers_;
    std::thread receiver_;
};

}  // namespace dlod::daemon
