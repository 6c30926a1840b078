#include "daemon/publish/lcm_url.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

namespace dlod::daemon {
namespace {

std::string group(const std::string& url) {
    const auto found = multicast_group_of(url);
    return found ? driver::to_string(found->endpoint) + " ttl " + std::to_string(found->ttl) : "none";
}

TEST(LcmUrl, TheGroupAndItsReachAreReadAsLcmReadsThem) {
    EXPECT_EQ(group("udpm://239.1.2.3:7000?ttl=1"), "239.1.2.3:7000 ttl 1");
    EXPECT_EQ(group("udpm://239.1.2.3:7000?recv_buf_size=2000000&ttl=3&x=y"), "239.1.2.3:7000 ttl 3");
    EXPECT_EQ(group("udpm://239.1.2.3:7000?recv_buf_size=2000000"), "239.1.2.3:7000 ttl 0");
    EXPECT_EQ(group("udpm://239.1.2.3"), "239.1.2.3:7667 ttl 0");
    EXPECT_EQ(group("udpm://"), "239.255.76.67:7667 ttl 0");
    EXPECT_EQ(group("udpm://?ttl=1"), "239.255.76.67:7667 ttl 1");
    for (const char* url : {"udpm://192.168.1.1:7667", "udpm://239.1.2.3:99999", "udpm://239.1.2:7667",
                            "udpm:239.1.2.3:7667", "memq://", "tcpq://127.0.0.1:7700", "none", ""}) {
        EXPECT_EQ(group(url), "none") << url;
    }
}

TEST(LcmUrl, AnEmptyOneIsTheEnvironmentsOrLcmsOwn) {
    ::unsetenv("LCM_DEFAULT_URL");
    EXPECT_EQ(url_or_default(""), "udpm://239.255.76.67:7667?ttl=0");
    ::setenv("LCM_DEFAULT_URL", "udpm://239.9.9.9:7667?ttl=1", 1);
    EXPECT_EQ(url_or_default(""), "udpm://239.9.9.9:7667?ttl=1");
    EXPECT_EQ(url_or_default("memq://"), "memq://");
    ::unsetenv("LCM_DEFAULT_URL");
}

TEST(LcmUrl, OnlyMulticastNeedsARoute) {
    EXPECT_TRUE(has_route("memq://"));
    EXPECT_TRUE(has_route("tcpq://127.0.0.1:7700"));
}

TEST(LcmUrl, TheServerOfTcpqIsAnAddress) {
    for (const char* url : {"tcpq://", "tcpq://10.0.0.1", "tcpq://10.0.0.1:7700", "tcpq://10.0.0.1:7700?a=b",
                            "udpm://239.1.2.3:7000", "memq://", ""}) {
        EXPECT_TRUE(has_usable_server(url)) << url;
    }
    for (const char* url :
         {"tcpq://planner", "tcpq://planner:7700", "tcpq://[fe80::1]:7700", "tcpq://10.0.0.1:77000"}) {
        EXPECT_FALSE(has_usable_server(url)) << url;
    }
}

TEST(LcmUrl, OnlyTcpqCanBeBlocked) {
    EXPECT_TRUE(can_be_blocked("tcpq://10.0.0.1:7700"));
    for (const char* url : {"", "udpm://239.1.2.3:7000?ttl=1", "memq://", "file://log"}) {
        EXPECT_FALSE(can_be_blocked(url)) << url;
    }
    ::setenv("LCM_DEFAULT_URL", "tcpq://10.0.0.1:7700", 1);
    EXPECT_TRUE(can_be_blocked(""));
    ::unsetenv("LCM_DEFAULT_URL");
}

}  // namespace
}  // namespace dlod::daemon
