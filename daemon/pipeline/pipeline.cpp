#include "daemon/pipeline/pipeline.hpp"

#include <sys/eventfd.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <cmath>
#include <system_error>
#include <utility>

namespace dlod::daemon {
namespace {

/// Two under construction, and one at work and one waiting at each of the heavier stages.
constexpr std::size_t kReplayFrames = 9;
/// One thread finishes a frame before it begins the next: two under construction, two free as the ingest wants them.
constexpr std::size_t kSingleThreadFrames = 4;
/// Live, none may be missing although every stage has one at work and one waiting.
constexpr std::size_t kLiveFrames = 13;
/// Between stages: what is further ahead is only older when its turn comes.
constexpr std::size_t kQueueLength = 1;
/// The map stage has nothing to do most of the time.
constexpr auto kClaimRetry = std::chrono::milliseconds(1);

std::size_t pool_size(const PipelineOptions& options) {
    if (options.live) return kLiveFrames + static_cast<std::size_t>(options.waiting_frames);
    return options.threads == 1 && !options.paced ? kSingleThreadFrames : kReplayFrames;
}

int make_event_descriptor() {
    const int descriptor = ::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
    if (descriptor < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
    return descriptor;
}

}  // namespace

Pipeline::Pipeline(const driver::SensorInfo& sensor, const MethodConfig& method,
                   const driver::FrameBuilderConfig& frames, driver::PacketSource& source, FrameSinks sinks,
                   PipelineOptions options)
    : geometry_(sensor.model),
      method_(sensor.model, method),
      source_(source),
      sinks_(std::move(sinks)),
      options_(std::move(options)),
      done_descriptor_(make_event_descriptor()),
      admission_(options_.live ? std::llround(options_.most_latency_turns * 1e9 * sensor.model.frame_period_s) : 0),
      pool_(sensor.model, pool_size(options_)),
      to_prepare_(pool_.size()),
      to_odometry_(kQueueLength),
      to_detection_(kQueueLength),
      to_publish_(kQueueLength),
      to_map_(kQueueLength),
      to_write_(kQueueLength),
      prepare_(to_prepare_, to_odometry_, pool_.dropped(),
               options_.live ? static_cast<std::size_t>(options_.waiting_frames) : 0, admission_,
               [this](PipelineFrame& frame) { prepare(frame); }),
      odometry_(
          to_odometry_, to_detection_, [this](PipelineFrame& frame) { estimate_pose(frame); },
          [this] { return detection_.completed() + kFeedbackDelay > odometry_.completed(); }),
      detection_(to_detection_, to_publish_, [this](PipelineFrame& frame) { detect_and_track(frame); }),
      publish_(to_publish_, to_map_, [this](PipelineFrame& frame) { publish(frame); }),
      map_(to_map_, to_write_, [this](PipelineFrame& frame) { update_map(frame); }),
      write_(to_write_, pool_.finished(), [this](PipelineFrame& frame) { write(frame); }),
      ingest_(source, sensor, frames, pool_, to_prepare_, prepare_, events_,
              {.live = options_.live,
               .paced = receives_on_own_thread(),
               .imu = receives_on_own_thread() ? sinks_.imu : nullptr}),
      workers_(actors(), events_, [this] { signal_if_done(); }) {}

Pipeline::~Pipeline() {
    source_.stop();
    workers_.stop();
    ingest_.abandon();
    if (receiver_.joinable()) receiver_.join();
    ::close(done_descriptor_);
}

std::vector<Actor*> Pipeline::actors() {
    // The most advanced frame first: it is the oldest, and its data are still in the cache.
    std::vector<Actor*> actors = {&write_, &map_, &publish_, &detection_, &odometry_, &prepare_};
    if (!receives_on_own_thread()) actors.push_back(&ingest_);
    return actors;
}

void Pipeline::start() {
    workers_.start(options_.threads, options_.on_thread_start);
    if (receives_on_own_thread()) {
        receiver_ = std::thread([this] {
            if (options_.on_thread_start) options_.on_thread_start(options_.threads);
            ingest_.run_until_end();
            signal_if_done();
        });
    }
}

bool Pipeline::done() const {
    return workers_.failed() ||
           (ingest_.ended() && write_.completed() + prepare_.dropped_frames() == ingest_.emitted_frames());
}

bool Pipeline::moves_on() {
    const std::array<const Stage*, 6> stages = {&prepare_, &odometry_, &detection_, &publish_, &map_, &write_};
    bool moving = ingest_.ended() || std::exchange(ingest_steps_, ingest_.steps()) != ingest_.steps();
    for (std::size_t i = 0; i < stages.size(); ++i) {
        const Progress now{stages[i]->completed(), stages[i]->has_work()};
        const Progress before = std::exchange(progress_[i], now);
        if (before.had_work && now.completed == before.completed) moving = false;
    }
    return moving;
}

void Pipeline::rethrow_failure() const {
    if (workers_.failed()) std::rethrow_exception(workers_.failure());
}

void Pipeline::signal_if_done() {
    if (!done()) return;
    const std::uint64_t one = 1;
    [[maybe_unused]] const auto written = ::write(done_descriptor_, &one, sizeof(one));
}

std::vector<CellTable::Entry> Pipeline::map_snapshot() {
    while (!map_.try_claim()) std::this_thread::sleep_for(kClaimRetry);
    auto snapshot = method_.map().snapshot();
    map_.release();
    // A worker may have found the stage claimed and gone to sleep.
    events_.notify();
    return snapshot;
}

void Pipeline::prepare(PipelineFrame& frame) {
    frame.restart = restart_requested_.exchange(false);
    const auto timed = [&](Step step, auto&& work) {
        const StepTimer timer(frame.times, step);
        work();
    };
    timed(Step::kGeometry, [&] {
        geometry_.process(frame);
        options_.body.process(frame);
    });
    timed(Step::kSubsampling, [&] { method_.subsample(frame); });
    timed(Step::kGround, [&] { method_.remove_ground(frame); });
    timed(Step::kSegmentation, [&] { method_.segment(frame); });
}

void Pipeline::estimate_pose(PipelineFrame& frame) {
    {
        const StepTimer timer(frame.times, Step::kOdometry);
        method_.estimate_pose(frame, feedback_[odometry_.completed() % kFeedbackDelay]);
    }
    {
        const StepTimer timer(frame.times, Step::kPublish);
        if (sinks_.publish_pose) sinks_.publish_pose(frame);
    }
    frame.pose_latency_ms = latency_ms(frame);
}

void Pipeline::detect_and_track(PipelineFrame& frame) {
    const auto timed = [&](Step step, auto&& work) {
        const StepTimer timer(frame.times, step);
        work();
    };
    timed(Step::kDetection, [&] { method_.detect(frame); });
    timed(Step::kTracking, [&] { method_.track(frame); });
    timed(Step::kRemoval,
          [&] { method_.remove_dynamic_points(frame, feedback_[detection_.completed() % kFeedbackDelay]); });
}

void Pipeline::publish(PipelineFrame& frame) {
    {
        const StepTimer timer(frame.times, Step::kPublish);
        if (sinks_.publish) sinks_.publish(frame);
    }
    frame.latency_ms = latency_ms(frame);
    admission_.published(frame.admission, StepTimer::now_ns(CLOCK_MONOTONIC));
}

/// Since its last packet was received.
float Pipeline::latency_ms(const PipelineFrame& frame) {
    return static_cast<float>(1e-6 * static_cast<double>(StepTimer::now_ns(CLOCK_MONOTONIC) - frame.received_ns));
}

void Pipeline::update_map(PipelineFrame& frame) {
    const StepTimer timer(frame.times, Step::kMap);
    method_.update_map(frame);
    if (frame.restart) restarts_.store(restarts_.load() + 1);
}

void Pipeline::write(PipelineFrame& frame) {
    if (sinks_.write) sinks_.write(frame);
    if (sinks_.finished) sinks_.finished(frame);
}

}  // namespace dlod::daemon
