#include "daemon/doctor/checks.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

#include "tests/support/small_disk.hpp"
#include "tests/support/synthetic_capture.hpp"

namespace dlod::daemon {
namespace {

using Verdict = Check::Verdict;

TEST(DoctorChecks, ASmallReceiveBufferIsGrantedAndAHugeOneIsMendedBySysctl) {
    EXPECT_EQ(check_receive_buffer(4096).verdict, Verdict::kGood);
    const Check huge = check_receive_buffer(1 << 30);
    EXPECT_EQ(huge.verdict, Verdict::kWarning);
    EXPECT_NE(huge.remedy.find("net.core.rmem_max=1073741824"), std::string::npos);
}

TEST(DoctorChecks, MulticastOfNoMulticastUrlIsNamed) {
    for (const char* url : {"none", "udpm://192.168.1.1:7667", "memq://"}) {
        const Check check = check_multicast(url);
        EXPECT_EQ(check.verdict, Verdict::kWarning) << url;
        EXPECT_NE(check.finding.find(url), std::string::npos);
    }
}

TEST(DoctorChecks, MulticastHasARouteOrNamesTheCommand) {
    const Check check = check_multicast("udpm://239.255.76.67:7667?ttl=1");
    if (check.verdict == Verdict::kFailure) {
        EXPECT_NE(check.remedy.find("ip route add 224.0.0.0/4"), std::string::npos);
    } else {
        EXPECT_NE(check.finding.find("ttl 1"), std::string::npos);
    }
}

TEST(DoctorChecks, WhatIsNotConfiguredIsGood) {
    EXPECT_EQ(check_realtime_priority(0).verdict, Verdict::kGood);
    EXPECT_EQ(check_locked_memory(false).verdict, Verdict::kGood);
    EXPECT_EQ(check_sensor("", "sensor.json").verdict, Verdict::kGood);
}

TEST(DoctorChecks, DiskTellsMissingAndFull) {
    const test::TemporaryFolder folder;
    const auto here = folder.path();
    EXPECT_EQ(check_disk(here, 1).verdict, Verdict::kGood);
    const Check made = check_disk(here / "not/yet", 1);
    EXPECT_EQ(made.verdict, Verdict::kGood) << "dlod makes it";
    EXPECT_TRUE(made.finding.ends_with(here.string())) << made.finding;
    std::ofstream(here / "file") << "x";
    EXPECT_EQ(check_disk(here / "file" / "state", 1).verdict, Verdict::kFailure);
    const Check full = check_disk(here, UINT64_MAX);
    EXPECT_EQ(full.verdict, Verdict::kWarning);
    EXPECT_NE(full.remedy.find(here.string()), std::string::npos);
}

TEST(DoctorChecks, WhatAFolderHoldsAlreadyNeedsNoRoom) {
    const test::SmallDisk disk(1'000'000);
    if (!disk.usable()) GTEST_SKIP() << "no file system can be mounted here";
    std::filesystem::create_directory(disk.path() / "recordings");
    std::ofstream(disk.path() / "recordings" / "dlod_000001.pcap") << std::string(500'000, 'x');
    EXPECT_EQ(check_disk(disk.path() / "recordings", 900'000).verdict, Verdict::kGood);
    EXPECT_EQ(check_disk(disk.path() / "results", 900'000).verdict, Verdict::kWarning);
}

TEST(DoctorChecks, WithoutASensorNothingCanRun) {
    const Check check = check_sensor("", "");
    EXPECT_EQ(check.verdict, Verdict::kFailure);
    EXPECT_NE(check.remedy.find("sensor.host"), std::string::npos);
}

TEST(DoctorChecks, AnAbsentSensorIsAFailureWithItsHost) {
    const Check check = check_sensor("127.0.0.1:1", "");
    EXPECT_EQ(check.verdict, Verdict::kFailure);
    EXPECT_NE(check.finding.find("127.0.0.1:1"), std::string::npos);
    EXPECT_FALSE(check.remedy.empty());
}

}  // namespace
}  // namespace dlod::daemon
