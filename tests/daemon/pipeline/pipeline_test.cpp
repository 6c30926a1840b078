// The staged pipeline gives the same bytes as the plain sequential form, whatever the threads and the speed.
#include "daemon/pipeline/pipeline.hpp"

#include <gtest/gtest.h>
#include <poll.h>

#include <sstream>

#include "core/dynamic_lidar_odometry.hpp"
#include "daemon/output/result_writer.hpp"
#include "driver/paced_source.hpp"
#include "driver/pcap_source.hpp"
#include "tests/support/cpu_wait.hpp"
#include "tests/support/file_content.hpp"
#include "tests/support/sanitizers.hpp"
#include "tests/support/synthetic_capture.hpp"

namespace dlod::daemon {
namespace {

using test::content;

constexpr int kFrames = 25;

class PipelineTest : public testing::Test {
  protected:
    static void SetUpTestSuite() {
        folder_ = new test::TemporaryFolder;
        capture_ = test::SyntheticCapture(kFrames).write(folder_->path());
        sensor_ = driver::load_metadata(folder_->path() / "drive.json");
        run_sequentially(folder_->path() / "sequential");
    }
    static void TearDownTestSuite() { delete folder_; }

    /// The method's one-page form, frame by frame on this thread.
    static void run_sequentially(const std::filesystem::path& out) {
        ResultWriter writer(out, TimingClock::kWall);
        PipelineFrame frames[2] = {PipelineFrame(sensor_.model), PipelineFrame(sensor_.model)};
        std::vector<PipelineFrame*> free = {&frames[0], &frames[1]};
        const driver::Geometry geometry(sensor_.model);
        DynamicLidarOdometry method(sensor_.model, {});
        driver::FrameBuilder builder(
            sensor_, {},
            [&]() -> Frame* {
                PipelineFrame* const frame = free.back();
                free.pop_back();
                return frame;
            },
            [&](Frame* emitted) {
                auto* const frame = static_cast<PipelineFrame*>(emitted);
                geometry.process(*frame);
                method.process(*frame);
                writer.write(*frame);
                free.push_back(frame);
            });
        driver::PcapSource source(capture_);
        for (auto batch = source.next(); batch.status == driver::SourceStatus::kPackets; batch = source.next()) {
            for (const auto& packet : batch.packets) builder.push(packet);
        }
        builder.flush();
        method.map().finish();
        writer.finish(method.map().points());
    }

    static void wait_until_done(const Pipeline& pipeline) {
        pollfd done{pipeline.done_descriptor(), POLLIN, 0};
        while (!pipeline.done()) ASSERT_GE(::poll(&done, 1, 30'000), 1) << "the pipeline hangs";
    }

    static void run_staged(const std::filesystem::path& out, int threads, double rate) {
        ResultWriter writer(out, TimingClock::kWall);
        driver::PacedSource source(std::make_unique<driver::PcapSource>(capture_), rate);
        FrameSinks sinks;
        sinks.write = [&](PipelineFrame& frame) { writer.write(frame); };
        Pipeline pipeline(sensor_, {}, {}, source, std::move(sinks), {.threads = threads, .paced = rate > 0.0});
        pipeline.start();
        wait_until_done(pipeline);
        pipeline.rethrow_failure();
        EXPECT_EQ(pipeline.finished_frames(), kFrames);
        EXPECT_EQ(pipeline.dropped_frames(), 0U);
        pipeline.map().finish();
        writer.finish(pipeline.map().points());
    }

    /// frames.csv without its columns of times: those from latency_ms on.
    static std::string without_times(const std::string& csv) {
        std::istringstream lines(csv);
        std::string kept;
        for (std::string line; std::getline(lines, line);) {
            std::size_t end = 0;
            for (int column = 0; column < 7; ++column) end = line.find(',', end) + 1;
            kept += line.substr(0, end) + '\n';
        }
        return kept;
    }

    static void expect_same_as_sequential(const std::filesystem::path& out) {
        const auto reference = folder_->path() / "sequential";
        for (const char* name : {"trajectory.tum", "labels.bin", "instances.bin", "tracks.csv", "map.pcd"}) {
            EXPECT_TRUE(content(reference / name) == content(out / name)) << name << " differs";
        }
        EXPECT_EQ(without_times(content(reference / "frames.csv")), without_times(content(out / "frames.csv")));
    }

    static test::TemporaryFolder* folder_;
    static std::filesystem::path capture_;
    static driver::SensorInfo sensor_;
};
test::TemporaryFolder* PipelineTest::folder_ = nullptr;
std::filesystem::path PipelineTest::capture_;
driver::SensorInfo PipelineTest::sensor_;

TEST_F(PipelineTest, TheSequentialFormFindsPosesAndLabels) {
    const auto trajectory = content(folder_->path() / "sequential" / "trajectory.tum");
    EXPECT_EQ(std::count(trajectory.begin(), trajectory.end(), '\n'), kFrames);
    const auto labels = content(folder_->path() / "sequential" / "labels.bin");
    EXPECT_EQ(labels.size(),
              static_cast<std::size_t>(kFrames) * test::SyntheticCapture::kRows * test::SyntheticCapture::kColumns);
}

TEST_F(PipelineTest, EveryNumberOfThreadsGivesTheSequentialBytes) {
    for (const int threads : {1, 2, 4}) {
        SCOPED_TRACE(threads);
        const auto out = folder_->path() / ("threads" + std::to_string(threads));
        run_staged(out, threads, 0.0);
        expect_same_as_sequential(out);
    }
}

TEST_F(PipelineTest, TrueRateGivesTheSequentialBytes) {
    const auto out = folder_->path() / "true_rate";
    run_staged(out, 2, 1.0);
    expect_same_as_sequential(out);
}

TEST_F(PipelineTest, WhatASinkThrowsEndsThePipelineAndIsRethrown) {
    driver::PcapSource source(capture_);
    FrameSinks sinks;
    int calls = 0;
    sinks.write = [&](PipelineFrame&) {
        if (++calls == 3) throw OutputError("disk full");
    };
    Pipeline pipeline(sensor_, {}, {}, source, std::move(sinks), {.threads = 2});
    pipeline.start();
    wait_until_done(pipeline);
    EXPECT_THROW(pipeline.rethrow_failure(), OutputError);
    EXPECT_EQ(calls, 3);
}

TEST_F(PipelineTest, ARestartBeginsAnewWithTheNextFrameInEveryStage) {
    for (const int threads : {1, 3}) {
        driver::PacedSource source(std::make_unique<driver::PcapSource>(capture_), 0.0);
        std::vector<std::uint64_t> restarted;
        std::vector<std::uint64_t> started;
        Pipeline* running = nullptr;
        FrameSinks sinks;
        sinks.publish = [&](PipelineFrame& frame) {
            if (frame.header.sequence == 9) running->request_restart();
            if (frame.restart) restarted.push_back(frame.header.sequence);
            if ((frame.odometry.flags & OdometryResult::kStarted) == 0) return;
            started.push_back(frame.header.sequence);
            EXPECT_LT(frame.odometry.T_world_sensor.translation().norm(), 0.2) << "the world begins here";
        };
        Pipeline pipeline(sensor_, {}, {}, source, std::move(sinks), {.threads = threads});
        running = &pipeline;
        pipeline.start();
        wait_until_done(pipeline);
        pipeline.rethrow_failure();
        ASSERT_EQ(restarted.size(), 1U);
        EXPECT_GE(restarted[0], 10U);
        EXPECT_LE(restarted[0], 18U) << "not later than the next frame to be prepared";
        EXPECT_EQ(started, (std::vector<std::uint64_t>{0, restarted[0]}));
        EXPECT_EQ(pipeline.restarts(), 1U);
    }
}

TEST_F(PipelineTest, TheMapCanBeCopiedAtAnyTime) {
    driver::PacedSource source(std::make_unique<driver::PcapSource>(capture_), 0.0);
    std::vector<std::size_t> sizes;
    Pipeline* running = nullptr;
    FrameSinks sinks;
    sinks.write = [&](PipelineFrame& frame) {
        if (frame.header.sequence % 6 == 0) sizes.push_back(running->map_snapshot().size());
    };
    Pipeline pipeline(sensor_, {}, {}, source, std::move(sinks), {.threads = 3});
    running = &pipeline;
    EXPECT_TRUE(pipeline.map_snapshot().empty()) << "before the first frame";
    pipeline.start();
    wait_until_done(pipeline);
    pipeline.rethrow_failure();
    ASSERT_EQ(sizes.size(), 5U);
    EXPECT_GT(sizes.back(), 100U);
    EXPECT_EQ(pipeline.map_snapshot().size(), pipeline.map().points().size());
}

TEST_F(PipelineTest, StoppingKeepsWhatWasReceived) {
    driver::PacedSource source(std::make_unique<driver::PcapSource>(capture_), 1.0);
    std::vector<std::uint64_t> written;
    FrameSinks sinks;
    sinks.write = [&](PipelineFrame& frame) { written.push_back(frame.header.sequence); };
    Pipeline pipeline(sensor_, {}, {}, source, std::move(sinks), {.threads = 1, .paced = true});
    pipeline.start();
    while (pipeline.finished_frames() < 3) ::poll(nullptr, 0, 10);
    pipeline.stop();
    wait_until_done(pipeline);
    EXPECT_EQ(written.size(), pipeline.ingest().emitted_frames());
    EXPECT_LT(written.size(), static_cast<std::size_t>(kFrames));
    for (std::size_t i = 0; i < written.size(); ++i) EXPECT_EQ(written[i], i);
}

/// Gives packets as fast as they are asked for, like a sensor that does not wait.
class ImpatientSource final : public driver::PacketSource {
  public:
    explicit ImpatientSource(const test::SyntheticCapture& capture) {
        for (const auto& packet : capture.packets()) {
            driver::Packet datagram;
            datagram.data = packet.data;
            datagram.receive_ns = packet.time_ns;
            datagram.destination_port = packet.port;
            packets_.push_back(datagram);
        }
    }
    driver::PacketBatch next() override {
        if (next_ == packets_.size()) return {driver::SourceStatus::kEnd, {}};
        return {driver::SourceStatus::kPackets, std::span(packets_).subspan(next_++, 1)};
    }
    void stop() noexcept override {}
    void visit_counters(const driver::CounterVisitor&) const override {}

  private:
    std::vector<driver::Packet> packets_;
    std::size_t next_ = 0;
};

TEST_F(PipelineTest, LiveTheNewestFramesWinAndEveryDropIsCounted) {
    const test::SyntheticCapture capture(60);
    ImpatientSource source(capture);
    std::vector<std::uint64_t> written;
    std::size_t imu_samples = 0;
    FrameSinks sinks;
    sinks.write = [&](PipelineFrame& frame) {
        written.push_back(frame.header.sequence);
        imu_samples += frame.imu.size();
        ::poll(nullptr, 0, 20);
    };
    // Without a bound on the latency: on a busy machine even the newest frame may come too late for that.
    Pipeline pipeline(sensor_, {}, {}, source, std::move(sinks),
                      {.threads = 2, .waiting_frames = 1, .most_latency_turns = 0.0, .live = true});
    pipeline.start();
    wait_until_done(pipeline);
    pipeline.rethrow_failure();
    const auto& counters = pipeline.ingest().counters();
    std::uint64_t without_frame = 0;
    std::uint64_t imu_packets = 0;
    counters.visit([&](std::string_view name, std::uint64_t value) {
        if (name == "dropped_frames") without_frame = value;
        if (name == "imu_packets") imu_packets = value;
    });
    EXPECT_GT(pipeline.dropped_frames() + without_frame, 0U);
    EXPECT_EQ(written.size() + pipeline.dropped_frames(), pipeline.ingest().emitted_frames());
    EXPECT_EQ(pipeline.ingest().emitted_frames() + without_frame, 60U);
    EXPECT_TRUE(std::is_sorted(written.begin(), written.end()));
    // The last turns may have found no frame.
    EXPECT_LT(written.back(), 60U);
    EXPECT_GE(written.back() + 1 + without_frame, 60U) << "the newest frame must not be dropped";
    // Those of turns that found no frame at all go on with the next frame, if one comes and they are not too many.
    EXPECT_LE(imu_samples, imu_packets);
    if (without_frame == 0) {
        EXPECT_EQ(imu_samples, imu_packets) << "the samples of dropped frames go on with the next ones";
    }
}

TEST_F(PipelineTest, LiveWithHalfTheTimeItNeedsLatencyIsBounded) {
    if (test::kTooSlowForTimes) GTEST_SKIP() << "a sanitizer is too slow for this";
    driver::PacedSource source(std::make_unique<driver::PcapSource>(capture_), 1.0);
    std::vector<float> latencies_ms;
    test::CpuWait cpu_wait;
    std::vector<std::int64_t> cpu_waits_ns;
    std::vector<std::uint64_t> poses;
    std::vector<std::uint64_t> published;
    FrameSinks sinks;
    sinks.publish_pose = [&](PipelineFrame& frame) { poses.push_back(frame.header.sequence); };
    sinks.publish = [&](PipelineFrame& frame) {
        ::poll(nullptr, 0, 150);  // beside the other stages' work, as if the CPU were taken away
        published.push_back(frame.header.sequence);
    };
    sinks.finished = [&](const PipelineFrame& frame) {
        EXPECT_LE(frame.pose_latency_ms + 150.0F, frame.latency_ms) << "poses do not wait for the rest";
        latencies_ms.push_back(frame.latency_ms);
        cpu_waits_ns.push_back(cpu_wait.total_ns());
    };
    Pipeline pipeline(sensor_, {}, {}, source, std::move(sinks), {.threads = 2, .live = true});
    pipeline.start();
    wait_until_done(pipeline);
    pipeline.rethrow_failure();
    EXPECT_GT(pipeline.dropped_frames(), 5U);
    EXPECT_EQ(pipeline.finished_frames() + pipeline.dropped_frames(), kFrames);
    EXPECT_EQ(poses, published);
    // The first ones teach what to expect.
    ASSERT_GT(latencies_ms.size(), 8U);
    for (std::size_t i = 6; i < latencies_ms.size(); ++i) {
        // Three frames may be at work or wait: what held up others while this one lived held it up, too.
        const double held_up_ms = 1e-6 * static_cast<double>(cpu_waits_ns[i] - cpu_waits_ns[i - 3]);
        EXPECT_LT(latencies_ms[i], 230.0 + held_up_ms) << "frame " << i << ", without the CPU for " << held_up_ms;
    }
}

}  // namespace
}  // namespace dlod::daemon
