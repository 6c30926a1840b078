#include "daemon/pipeline/stage.hpp"

#include <gtest/gtest.h>

#include "tests/support/synthetic_frame.hpp"

namespace dlod::daemon {
namespace {

/// The first stage, and a frame that comes again and again with ten readings of the IMU.
class IntakeTest : public ::testing::Test {
  protected:
    void push() {
        frame_.imu.clear();
        for (int i = 0; i < 10; ++i) frame_.imu.push_back({.stamp_ns = next_stamp_ns_++});
        in_.push(&frame_);
    }

    Admission admission_{0};
    FrameQueue in_{4}, out_{4}, dropped_{4};
    PipelineFrame frame_{test::small_sensor()};
    std::int64_t next_stamp_ns_ = 1;
    IntakeStage stage_{in_, out_, dropped_, 1, admission_, [](PipelineFrame&) {}};
};

TEST_F(IntakeTest, AFrameTakesOverTheReadingsOfThoseDroppedBeforeIt) {
    for (int i = 0; i < 3; ++i) {
        push();
        ASSERT_EQ(stage_.steal(), &frame_);
    }
    push();
    stage_.run();
    EXPECT_EQ(stage_.dropped_frames(), 3U);
    ASSERT_EQ(frame_.imu.size(), 40U);
    for (std::size_t i = 0; i < 40; ++i) EXPECT_EQ(frame_.imu[i].stamp_ns, static_cast<std::int64_t>(i + 1));
}

TEST_F(IntakeTest, WhileTheStagesBehindHangItsMemoryIsBounded) {
    for (int i = 0; i < 1000; ++i) {
        push();
        ASSERT_EQ(stage_.steal(), &frame_);
    }
    push();
    stage_.run();
    ASSERT_EQ(frame_.imu.size(), IntakeStage::kMostLeftBehind + 10) << "the newest";
    EXPECT_EQ(frame_.imu.back().stamp_ns, 10'010);
    EXPECT_EQ(frame_.imu.front().stamp_ns, 10'011 - static_cast<std::int64_t>(frame_.imu.size()));
}

}  // namespace
}  // namespace dlod::daemon
