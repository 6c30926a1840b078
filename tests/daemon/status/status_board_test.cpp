#include "daemon/status/status_board.hpp"

#include <gtest/gtest.h>

#include "tests/support/synthetic_frame.hpp"

namespace dlod::daemon {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;

class StatusBoardTest : public testing::Test {
  protected:
    StatusBoardTest() : board_("1.2.3", "OS-0-32 123456", kSecond), frame_(test::small_sensor()) {
        frame_.odometry.valid = true;
    }

    status_t at(double seconds, CounterList counters, double last_packet_s) {
        const auto ns = [](double s) { return static_cast<std::int64_t>(1e9 * s); };
        return board_.compose(counters, ns(last_packet_s), ns(seconds), 42);
    }
    void pose_at(double seconds) { board_.add(frame_, static_cast<std::int64_t>(1e9 * seconds)); }

    StatusBoard board_;
    PipelineFrame frame_;
};

TEST_F(StatusBoardTest, RatesAreOverTheTimeSinceTheLastStatus) {
    at(2.0, {{"lidar_packets", 640}, {"frames", 10}}, 2.0);
    for (int i = 0; i < 18; ++i) pose_at(2.0 + 0.1 * i);
    const auto status = at(4.0, {{"lidar_packets", 1920}, {"frames", 30}}, 4.0);
    EXPECT_DOUBLE_EQ(status.packet_rate, 640.0);
    EXPECT_DOUBLE_EQ(status.frame_rate, 10.0);
    EXPECT_DOUBLE_EQ(status.pose_rate, 9.0);
    EXPECT_EQ(status.pose_age, 300'000);
    EXPECT_EQ(status.uptime, 3'000'000);
    EXPECT_EQ(status.health, status_t::OK) << status.health_text;
    ASSERT_EQ(status.counters, 2);
    EXPECT_EQ(status.counter_name[1], "frames");
    EXPECT_EQ(status.counter_value[1], 30);
    EXPECT_GT(status.memory, 0);
}

TEST_F(StatusBoardTest, ACounterThatBeginsAnewGivesNoRate) {
    at(2.0, {{"lidar_packets", 640}, {"frames", 10}, {"lost_packets", 9}}, 2.0);
    pose_at(3.0);
    const auto status = at(3.0, {{"lidar_packets", 64}, {"frames", 1}, {"lost_packets", 1}}, 3.0);
    EXPECT_EQ(status.packet_rate, 0.0);
    EXPECT_EQ(status.frame_rate, 0.0);
}

TEST_F(StatusBoardTest, PercentilesAreOfTheLastFrames) {
    for (int i = 1; i <= 100; ++i) {
        frame_.pose_latency_ms = 0.5F * static_cast<float>(i);
        frame_.latency_ms = static_cast<float>(i);
        pose_at(2.0);
    }
    const auto status = at(2.0, {}, 2.0);
    ASSERT_EQ(status.stage_name.back(), "latency");
    ASSERT_EQ(status.stage_name[kStepCount], "pose_latency");
    EXPECT_EQ(status.stage_p50[kStepCount], 25.0F);
    EXPECT_EQ(status.stage_p50.back(), 50.0F);
    EXPECT_EQ(status.stage_p99.back(), 99.0F);
    EXPECT_EQ(status.stage_max.back(), 100.0F);
}

TEST_F(StatusBoardTest, HealthSaysWhatIsWrongAndWhatToDo) {
    EXPECT_EQ(at(2.0, {}, 0.0).health, status_t::WAITING);
    EXPECT_NE(board_.one_line().find("no packets"), std::string::npos) << board_.one_line();
    pose_at(3.0);
    EXPECT_EQ(at(3.0, {}, 3.0).health, status_t::OK);
    EXPECT_EQ(at(4.0, {{"packets_kernel_drops", 5}}, 4.0).health, status_t::DEGRADED);
    EXPECT_NE(board_.one_line().find("net.core.rmem_max"), std::string::npos) << board_.one_line();
    for (int second = 5; second < 14; ++second) pose_at(second);
    EXPECT_EQ(at(13.5, {{"packets_kernel_drops", 5}}, 13.5).health, status_t::DEGRADED) << "remembered for ten seconds";
    pose_at(15.0);
    EXPECT_EQ(at(15.0, {{"packets_kernel_drops", 5}}, 15.0).health, status_t::OK);
    EXPECT_EQ(at(20.0, {{"packets_kernel_drops", 5}}, 20.0).health, status_t::FAULT)
        << "packets, but no pose for five seconds";
    EXPECT_EQ(at(30.0, {{"packets_kernel_drops", 5}}, 20.0).health, status_t::WAITING);
}

TEST_F(StatusBoardTest, ResultFilesThatAreGivenUpAreNotForgotten) {
    pose_at(2.0);
    EXPECT_EQ(at(2.0, {{"output_failures", 1}, {"recording_write_failed", 3}}, 2.0).health, status_t::DEGRADED);
    EXPECT_NE(board_.one_line().find("recording.folder"), std::string::npos) << board_.one_line();
    for (int second = 3; second < 30; ++second) {
        pose_at(second);
        at(second, {{"output_failures", 1}, {"recording_write_failed", 3}}, second);
    }
    EXPECT_EQ(board_.one_line().find("recording.folder"), std::string::npos) << board_.one_line();
    EXPECT_NE(board_.one_line().find("output.folder"), std::string::npos) << board_.one_line();
}

TEST_F(StatusBoardTest, PacketsThatHaveOnlyJustComeMayBeWithoutAPose) {
    EXPECT_EQ(at(60.0, {}, 0.0).health, status_t::WAITING) << "a sensor that boots slowly";
    EXPECT_EQ(at(61.0, {}, 61.0).health, status_t::OK) << board_.one_line();
    pose_at(62.0);
    EXPECT_EQ(at(70.0, {}, 63.0).health, status_t::WAITING) << "unplugged";
    EXPECT_EQ(at(71.0, {}, 71.0).health, status_t::OK) << board_.one_line();
    EXPECT_EQ(at(74.0, {}, 74.0).health, status_t::FAULT) << "packets, but no pose for three seconds";
}

TEST_F(StatusBoardTest, AnUnpluggedSensorIsNoLostOdometry) {
    at(60.0, {}, 60.0);
    pose_at(69.9);
    EXPECT_EQ(at(70.0, {}, 70.0).health, status_t::OK) << board_.one_line();
    // The last pose is older than the last packet by what a frame takes.
    for (const double now_s : {71.0, 71.95, 72.0}) EXPECT_EQ(at(now_s, {}, 70.0).health, status_t::OK) << now_s;
    EXPECT_EQ(at(72.05, {}, 70.0).health, status_t::WAITING) << board_.one_line();
}

TEST_F(StatusBoardTest, AnAnswerGoesOutAtOnceAndStays) {
    pose_at(2.0);
    EXPECT_EQ(at(2.0, {{"frames", 10}}, 2.0).command_id, 0) << "none yet";
    const auto now = board_.answer({.id = 77, .ok = true, .text = "map saved"}, 1234);
    EXPECT_EQ(now.utime, 1234);
    EXPECT_EQ(now.counter_value, std::vector<std::int64_t>{10}) << "the rest is that of the last status";
    for (const auto& status : {now, at(3.0, {{"frames", 20}}, 3.0)}) {
        EXPECT_EQ(status.command_id, 77);
        EXPECT_EQ(status.command_ok, 1);
        EXPECT_EQ(status.command_answer, "map saved");
    }
    EXPECT_EQ(board_.answer({.id = 78, .ok = false, .text = "no"}, 1235).command_ok, 0);
}

}  // namespace
}  // namespace dlod::daemon
