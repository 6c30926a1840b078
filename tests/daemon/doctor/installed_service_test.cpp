#include "daemon/doctor/installed_service.hpp"

#include <gtest/gtest.h>

#include "daemon/doctor/checks.hpp"
#include "tests/support/synthetic_capture.hpp"

namespace dlod::daemon {
namespace {

TEST(InstalledService, TheFilesPlaceTellsTheUnitAndItsFolder) {
    for (const char* file : {"/etc/dlod/dlod.yaml", "/opt/robot/etc/dlod/dlod.yaml", "/etc/dlod/../dlod/dlod.yaml"}) {
        const auto service = service_of(file);
        ASSERT_TRUE(service) << file;
        EXPECT_EQ(service->unit, "dlod");
        EXPECT_EQ(service->resolve("rec"), "/var/lib/dlod/rec");
        EXPECT_EQ(service->resolve("/data"), "/data");
    }
    const auto front = service_of("/etc/dlod/front.yaml");
    ASSERT_TRUE(front);
    EXPECT_EQ(front->unit, "dlod@front");
    EXPECT_EQ(front->resolve("rec"), "/var/lib/dlod-front/rec");
    for (const char* file : {"dlod.yaml", "/home/me/dlod.yaml", "/etc/dlod.yaml", "/etc/dlod/notes", "/etc/dlod/"}) {
        EXPECT_FALSE(service_of(file)) << file;
    }
}

TEST(InstalledService, MayWriteInItsOwnFolderOnly) {
    const auto service = service_of("/etc/dlod/front.yaml");
    ASSERT_TRUE(service);
    for (const char* own : {"/var/lib/dlod-front", "/var/lib/dlod-front/maps", "/var/lib/dlod-front/a/../b"}) {
        EXPECT_TRUE(service->may_write(own)) << own;
    }
    for (const char* other : {"/var/lib/dlod", "/var/lib/dlod-front2", "/var/lib/dlod-front/../x", "/data", "/"}) {
        EXPECT_FALSE(service->may_write(other)) << other;
    }
}

TEST(InstalledService, ItsFolderIsMadeBySystemdAndOthersMustBeLetInto) {
    const auto service = service_of("/etc/dlod/front.yaml");
    EXPECT_EQ(check_disk("/var/lib/dlod-front/rec", 1, service).verdict, Check::Verdict::kGood)
        << "whoever asks, and before it is there";
    const test::TemporaryFolder folder;
    const Check outside = check_disk(folder.path(), 1, service);
    EXPECT_EQ(outside.verdict, Check::Verdict::kWarning);
    EXPECT_NE(outside.remedy.find("systemctl edit dlod@front"), std::string::npos) << outside.remedy;
    EXPECT_NE(outside.remedy.find("ReadWritePaths=" + folder.path().string()), std::string::npos) << outside.remedy;
}

TEST(InstalledService, DoesNotSeeHomeDirectories) {
    const auto service = service_of("/etc/dlod/dlod.yaml");
    ASSERT_TRUE(service);
    for (const char* hidden : {"/home/me/os.json", "/root/os.json", "/etc/../home/me/os.json"}) {
        const Check check = check_sensor("", hidden, service);
        EXPECT_EQ(check.verdict, Check::Verdict::kFailure) << hidden;
        EXPECT_NE(check.remedy.find("/etc/dlod"), std::string::npos) << check.remedy;
        EXPECT_EQ(check_sensor("", hidden).verdict, Check::Verdict::kGood) << "by hand it is seen";
    }
    for (const char* seen : {"/etc/dlod/os.json", "/var/lib/dlod/os.json", "/homes/os.json"}) {
        EXPECT_EQ(check_sensor("", seen, service).verdict, Check::Verdict::kGood) << seen;
    }
}

}  // namespace
}  // namespace dlod::daemon
