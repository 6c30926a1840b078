// In the steady state preparation and odometry take nothing from the heap.
#include <gtest/gtest.h>

#include <array>
#include <atomic>
#include <cmath>
#include <cstdlib>
#include <new>

#include "core/map/keyframe_cloud.hpp"
#include "core/odometry/odometry.hpp"
#include "core/preprocess/subsampling.hpp"
#include "tests/support/simulated_drive.hpp"

namespace {

std::atomic<std::size_t> allocations{0};

void* allocate(std::size_t size, std::size_t alignment) {
    allocations.fetch_add(1, std::memory_order_relaxed);
    void* const p = std::aligned_alloc(alignment, (size + alignment - 1) / alignment * alignment);
    if (p == nullptr) throw std::bad_alloc();
    return p;
}

}  // namespace

// At -O1 GCC 12 sees free() in the inlined operator delete, but not that operator new is replaced too.
#pragma GCC diagnostic ignored "-Wmismatched-new-delete"

void* operator new(std::size_t size) {
    return allocate(size, alignof(std::max_align_t));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
    return allocate(size, static_cast<std::size_t>(alignment));
}
void operator delete(void* p) noexcept {
    std::free(p);
}
void operator delete(void* p, std::size_t) noexcept {
    std::free(p);
}
void operator delete(void* p, std::align_val_t) noexcept {
    std::free(p);
}
void operator delete(void* p, std::size_t, std::align_val_t) noexcept {
    std::free(p);
}

namespace dlod::test {
namespace {

/// To and fro, so that after a while everything has been seen.
Eigen::Isometry3d to_and_fro(double t) {
    Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
    T.translation() = Eigen::Vector3d(0.4 * std::sin(2.0 * t), 0.0, 0.0);
    T.linear() = Eigen::AngleAxisd(0.3 * std::sin(1.5 * t), Eigen::Vector3d::UnitZ()).toRotationMatrix();
    return T;
}

TEST(Allocation, PreparationAndOdometryTakeNothingInTheSteadyState) {
    constexpr int kWarm = 60;
    constexpr int kFrames = 90;
    SimulatedDrive drive(furnished_room(), to_and_fro);
    Frame frame(drive.sensor());
    Subsampling subsampling(drive.sensor(), {});
    Odometry odometry(drive.sensor(), {});
    std::array<OdometryFeedback, kFeedbackDelay> feedback;
    int steady = 0;
    for (int k = 0; k < kFrames; ++k) {
        drive.fill(k, frame);
        OdometryFeedback& slot = feedback[static_cast<std::size_t>(k % kFeedbackDelay)];
        const bool new_keyframe = k >= kFeedbackDelay && slot.has_keyframe;
        const std::size_t before = allocations;
        subsampling.process(frame);
        odometry.process(frame, k >= kFeedbackDelay ? &slot : nullptr);
        const std::size_t during = allocations - before;
        ASSERT_TRUE(frame.odometry.valid);
        if (k >= kWarm && !new_keyframe) {
            EXPECT_EQ(during, 0U) << k;
            ++steady;
        }
        slot.sequence = frame.header.sequence;
        slot.stamp_ns = frame.header.stamp_ns;
        slot.has_keyframe = frame.odometry.keyframe;
        if (slot.has_keyframe) {
            build_keyframe_cloud(
                frame, [](PixelIndex) { return false; }, slot.keyframe);
        }
    }
    EXPECT_GT(steady, (kFrames - kWarm) / 2);
}

}  // namespace
}  // namespace dlod::test
