// In the steady state the pipeline allocates next to nothing: every allocation of this program is counted.
#include <gtest/gtest.h>
#include <poll.h>

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdlib>
#include <new>

#include "daemon/pipeline/pipeline.hpp"
#include "driver/pcap_source.hpp"
#include "tests/support/synthetic_capture.hpp"

namespace {

std::atomic<std::uint64_t> allocations{0};

void* allocate(std::size_t size, std::size_t alignment) {
    allocations.fetch_add(1, std::memory_order_relaxed);
    void* memory = nullptr;
    if (posix_memalign(&memory, std::max(alignment, sizeof(void*)), size) != 0) throw std::bad_alloc();
    return memory;
}

}  // namespace

void* operator new(std::size_t size) {
    return allocate(size, alignof(std::max_align_t));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
    return allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* memory) noexcept {
    std::free(memory);
}
void operator delete(void* memory, std::size_t) noexcept {
    std::free(memory);
}
void operator delete(void* memory, std::align_val_t) noexcept {
    std::free(memory);
}
void operator delete(void* memory, std::size_t, std::align_val_t) noexcept {
    std::free(memory);
}

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
    std::uint64_t before = 0;
    std::uint64_t after = 0;
    FrameSinks sinks;
    sinks.finished = [&](const PipelineFrame&) {
        ++frames;
        if (frames == kWarmUp) before = allocations.load();
        after = allocations.load();
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
