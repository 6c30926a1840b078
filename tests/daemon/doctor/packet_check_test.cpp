#include "daemon/doctor/packet_check.hpp"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/fake_sensor.hpp"

namespace dlod::daemon {
namespace {

using namespace std::chrono_literals;
using Verdict = Check::Verdict;

TEST(PacketCheck, JudgesWhatACountMeans) {
    EXPECT_EQ(judge_packets({}, 2s).verdict, Verdict::kFailure);
    const Check good = judge_packets({.packets = 1300, .lidar_packets = 1280}, 2s);
    EXPECT_EQ(good.verdict, Verdict::kGood);
    EXPECT_NE(good.finding.find("640 lidar packets/s"), std::string::npos);
    EXPECT_TRUE(good.remedy.empty());
    const Check lossy = judge_packets({.packets = 1190, .lidar_packets = 1188, .lost_packets = 12}, 2s);
    EXPECT_EQ(lossy.verdict, Verdict::kWarning);
    EXPECT_NE(lossy.finding.find("1.00 %"), std::string::npos);
    EXPECT_NE(lossy.remedy.find("ethtool"), std::string::npos);
    const Check full = judge_packets({.packets = 9, .lidar_packets = 9, .lost_packets = 3, .kernel_drops = 3}, 2s);
    EXPECT_NE(full.remedy.find("rmem_max"), std::string::npos);
    const Check other = judge_packets({.packets = 9, .foreign = 9}, 2s);
    EXPECT_EQ(other.verdict, Verdict::kFailure);
    EXPECT_NE(other.finding.find("another sensor"), std::string::npos);
    EXPECT_EQ(judge_packets({.packets = 9, .lidar_packets = 8, .unfit = 1}, 2s).verdict, Verdict::kWarning);
}

TEST(PacketCheck, CountsWhatASensorSends) {
    test::SyntheticSensor described;
    described.lidar_port = 17512;
    described.imu_port = 17513;
    const test::FakeSensor sensor(described);
    SensorConfig config;
    config.host = sensor.host();
    const Check check = check_packets(config, 1500ms);
    EXPECT_EQ(check.verdict, Verdict::kGood) << check.finding;
    EXPECT_NE(check.finding.find("0 of"), std::string::npos) << check.finding;
}

TEST(PacketCheck, WhatIsMissingIsNamed) {
    SensorConfig config;
    EXPECT_EQ(check_packets(config, 1ms).verdict, Verdict::kWarning);
    config.metadata = "/nowhere/sensor.json";
    EXPECT_NE(check_packets(config, 1ms).finding.find("/nowhere/sensor.json"), std::string::npos);
    config.metadata = "";
    config.host = "127.0.0.1:1";
    EXPECT_EQ(check_packets(config, 1ms).verdict, Verdict::kFailure);
}

}  // namespace
}  // namespace dlod::daemon
