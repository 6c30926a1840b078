// The systemd units, checked by systemd's own tool.
#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <sstream>

#include "tests/support/child_process.hpp"
#include "tests/support/synthetic_capture.hpp"

namespace dlod {
namespace {

using namespace std::chrono_literals;

/// The unit with an executable that exists: dlod need not be installed.
std::string unit_text(const std::string& name) {
    std::ifstream stream("systemd/" + name);
    EXPECT_TRUE(stream) << "run the test in the source folder";
    std::ostringstream text;
    text << stream.rdbuf();
    std::string unit = text.str();
    const std::string binary = "/usr/bin/dlod";
    const auto at = unit.find(binary);
    EXPECT_NE(at, std::string::npos);
    return unit.replace(at, binary.size(), "/bin/true");
}

TEST(SystemdUnit, VerifyIsSilentAndExposureIsLow) {
    if (test::ChildProcess({"systemd-analyze", "--version"}).wait(20s) != 0) GTEST_SKIP() << "no systemd-analyze here";
    const test::TemporaryFolder folder;
    const std::pair<const char*, const char*> units[] = {{"dlod.service", "dlod.service"},
                                                         {"dlod@.service", "dlod@front.service"}};
    for (const auto& [file, instance] : units) {
        std::ofstream(folder.path() / file) << unit_text(file);
        test::ChildProcess verify({"systemd-analyze", "verify", "--man=no", (folder.path() / instance).string()});
        EXPECT_EQ(verify.wait(30s), 0) << instance;
        EXPECT_EQ(verify.output(), "") << instance;
        test::ChildProcess security(
            {"systemd-analyze", "security", "--offline=true", "--threshold=18", (folder.path() / file).string()});
        EXPECT_EQ(security.wait(30s), 0) << security.output();
    }
}

}  // namespace
}  // namespace dlod
