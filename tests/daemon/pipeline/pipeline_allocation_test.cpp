// In the steady state the pipeline allocates next to nothing: every allocation of the program is counted.
#include <gtest/gtest.h>
#include <poll.h>

#include <cstddef>

#include "daemon/pipeline/pipeline.hpp"
#include "driver/pcap_source.hpp"
#include "tests/support/allocation_counter.hpp"
#include "tests/support/synthetic_capture.hpp"

namespace dlod::daemon {
namespace {

TEST(PipelineAllocation, NextToNoneInTheSteadyState) {
    constexpr std::uint64_t kFrames = 120;
    constexpr std::uint64_t kWarmUp = 60;
    const test::TemporaryFolder folder;
    test::SyntheticSensor setup;
    setup.speed_mps = 0.5;
    const auto capture = test::SyntheticCapture(kFrames, setup).write(folder.path());
    const auto sensor = driver::load_metadata(folder.path() / "drive.json");
    driver::PcapSource source(capture, {.ports = {sensor.lidar_port, sensor.imu_port}, .reassembly = {}});
    std::uint64_t frames = 0;
    std::size_t before = 0;
    std::size_t after = 0;
    FrameSinks sinks;
    sinks.finished = [&](const PipelineFrame&) {
        ++frames;
        if (frames == kWarmUp) before = test::allocation_count();
        after = test::allocation_count();
    };
    Pipeline pipeline(sensor, {}, {}, source, std::move(sinks), {.threads = 1});
    pipeline.start();
    pollfd done{pipeline.done_descriptor(), POLLIN, 0};
    while (!pipeline.done()) ASSERT_GE(::poll(&done, 1, 60'000), 1) << "the pipeline hangs";
    pipeline.rethrow_failure();
    ASSERT_EQ(frames, kFrames);
    // A few for new keyframes, new objects and whatever is larger than ever before.
    const double a_frame = static_cast<double>(after - before) / static_cast<double>(kFrames - kWarmUp);
    RecordProperty("allocations_a_frame", std::to_string(a_frame));
    EXPECT_LT(a_frame, 5.0);
}

}  // namespace
}  // namespace dlod::daemon
