#include "daemon/config/consistency.hpp"

#include <gtest/gtest.h>

#include "daemon/config/config_file.hpp"

namespace dlod::daemon {
namespace {

/// Of settings that each are valid; empty: they are consistent.
std::string error_of(std::initializer_list<const char*> settings) {
    Config config;
    for (const char* setting : settings) apply_setting(config, setting);
    try {
        check_consistency(config);
    } catch (const ConfigError& error) {
        return error.what();
    }
    return "";
}

TEST(Consistency, WhatFitsTogetherPasses) {
    EXPECT_EQ(error_of({}), "");
    EXPECT_EQ(error_of({"sensor.host=os-1.local", "sensor.configure.udp_dest=@auto", "sensor.sender=fe80::1",
                        "sensor.multicast_group=239.1.2.3", "sensor.share_ports=true",
                        "sensor.bind_address=192.168.1.5", "sensor.forward_to=[::1]:7000", "sensor.lidar_port=7000"}),
              "");
    EXPECT_EQ(error_of({"robot_body.boxes_m=[0, 0, 0, 1, 1, 1]"}), "");
    for (const char* url :
         {"lcm.url=none", "lcm.url=udpm://", "lcm.url=udpm://?ttl=1", "lcm.url=udpm://239.1.2.3:7000?x=y&ttl=1",
          "lcm.url=tcpq://10.0.0.1:7700", "lcm.url=memq://"}) {
        EXPECT_EQ(error_of({url}), "");
    }
}

TEST(Consistency, ErrorsNameTheKey) {
    const std::string long_text(60, 'x');
    const std::string prefix = "lcm.channel_prefix=" + long_text;
    const std::string channel = "lcm.bot_core_channel=" + long_text + long_text;
    for (const auto& [key, settings] : std::vector<std::pair<std::string, std::vector<const char*>>>{
             {"extrinsics.rotation_wxyz", {"extrinsics.rotation_wxyz=[1, 1, 0, 0]"}},
             {"sensor.imu_port", {"sensor.lidar_port=7000", "sensor.imu_port=7000"}},
             {"sensor.bind_address", {"sensor.bind_address=eth0"}},
             {"sensor.host", {"sensor.host=http://192.168.1.20/"}},
             {"sensor.sender", {"sensor.sender=os-1.local"}},
             {"sensor.multicast_group", {"sensor.multicast_group=192.168.1.5"}},
             {"sensor.multicast_group", {"sensor.multicast_group=all"}},
             {"sensor.share_ports", {"sensor.share_ports=true"}},
             {"sensor.forward_to", {"sensor.forward_to=planner:7000"}},
             {"sensor.configure.lidar_mode", {"sensor.configure.lidar_mode=1024x10"}},
             {"robot_body.boxes_m", {"robot_body.boxes_m=[0, 0, 0, 1, 1]"}},
             {"lcm.obstacles.min_height_m", {"lcm.obstacles.min_height_m=2"}},
             {"lcm.url", {"lcm.url=239.255.76.67:7667"}},
             {"lcm.url", {"lcm.url=tcpq://planner:7700"}},
             {"lcm.url", {"lcm.url=udpm://10.0.0.1:7667"}},
             {"lcm.url", {"lcm.url=udpm://239.255.76.67:76670?ttl=1"}},
             {"lcm.channel_prefix", {prefix.c_str()}},
             {"lcm.bot_core_channel", {channel.c_str()}}}) {
        Config config;
        for (const char* setting : settings) ASSERT_NO_THROW(apply_setting(config, setting)) << setting;
        try {
            check_consistency(config);
            ADD_FAILURE() << key << " passes";
        } catch (const ConfigError& error) {
            EXPECT_EQ(std::string(error.what()).rfind(key + ": ", 0), 0U) << error.what();
        }
    }
}

}  // namespace
}  // namespace dlod::daemon
