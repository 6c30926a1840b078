#include "daemon/service/log.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <spdlog/spdlog.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>

namespace dlod::daemon {
namespace {

TEST(RepeatedWarnings, AreHeldBackAndCounted) {
    using std::chrono::seconds;
    set_up_log(2);
    RepeatedWarnings warnings(seconds(10));
    const auto start = RepeatedWarnings::Clock::now();
    testing::internal::CaptureStderr();
    EXPECT_TRUE(warnings.warn("drops", "a frame was dropped", start));
    for (int i = 1; i < 10; ++i) EXPECT_FALSE(warnings.warn("drops", "a frame was dropped", start + seconds(i)));
    EXPECT_TRUE(warnings.warn("other", "something else", start + seconds(5))) << "another kind";
    EXPECT_TRUE(warnings.warn("drops", "a frame was dropped", start + seconds(10)));
    const std::string log = testing::internal::GetCapturedStderr();
    EXPECT_NE(log.find("9 more like this"), std::string::npos) << log;
}

TEST(RepeatedWarnings, ThatAreEverOthersAreHeldBackToo) {
    set_up_log(2);
    RepeatedWarnings warnings(std::chrono::seconds(10));
    const auto now = RepeatedWarnings::Clock::now();
    testing::internal::CaptureStderr();
    std::size_t written = 0;
    for (int i = 0; i < 1000; ++i) {
        const std::string answer = "the sensor answers " + std::to_string(i);
        written += warnings.warn(answer, answer, now) ? 1 : 0;
    }
    testing::internal::GetCapturedStderr();
    EXPECT_EQ(written, RepeatedWarnings::kMostKinds + 1);
}

TEST(Log, TheJournalIsToldThePriorities) {
    testing::internal::CaptureStderr();
    struct stat file {};
    ASSERT_EQ(::fstat(STDERR_FILENO, &file), 0);
    ::setenv("JOURNAL_STREAM", fmt::format("{}:{}", file.st_dev, file.st_ino).c_str(), 1);
    spdlog::drop("dlod");
    set_up_log(2);
    spdlog::info("all is well");
    spdlog::warn("a frame was dropped");
    spdlog::error("the disk is full");
    ::setenv("JOURNAL_STREAM", "1:1", 1);
    spdlog::drop("dlod");
    set_up_log(2);
    spdlog::warn("by hand");
    ::unsetenv("JOURNAL_STREAM");
    EXPECT_EQ(testing::internal::GetCapturedStderr(),
              "<6>info: all is well\n<4>warning: a frame was dropped\n<3>error: the disk is full\nwarning: by hand\n");
}

}  // namespace
}  // namespace dlod::daemon
