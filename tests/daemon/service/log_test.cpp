#include "daemon/service/log.hpp"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace dlod::daemon
