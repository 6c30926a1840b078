// What happens to sensors on robots, played to the running program: reported in its status, recovered without a
// restart.
#include <gtest/gtest.h>

#include <csignal>
#include <string>

#include "tests/daemon/live/live_run.hpp"
#include "tests/support/fake_sensor.hpp"
#include "tests/support/sanitizers.hpp"

namespace dlod {
namespace {

using namespace std::chrono_literals;
using test::FakeSensor;
using test::LiveRun;
using test::on_live_ports;

auto health(std::int8_t health, const std::string& text) {
    return [=](const status_t& status) {
        return status.health == health && status.health_text.find(text) != std::string::npos;
    };
}
auto sensor_is(const std::string& text) {
    return [=](const status_t& status) { return status.sensor.find(text) != std::string::npos; };
}

TEST(SensorChanges, AwaitedUnpluggedRestartedAndReplaced) {
    LiveRun run;
    if (!run.usable()) GTEST_SKIP() << "no multicast here";
    FakeSensor sensor(on_live_ports());
    sensor.unplug();
    run.write_config("host: \"" + sensor.host() + "\"");
    run.start();
    EXPECT_TRUE(run.status_says(health(status_t::WAITING, sensor.host()))) << "it lives and says what it waits for";

    sensor.plug_in();
    EXPECT_TRUE(run.poses_flow());
    // A frame dropped on a busy machine is remembered for ten seconds; under a sanitizer, some always are.
    EXPECT_TRUE(test::kTooSlowForTimes || run.status_says(health(status_t::OK, ""), 25s));

    sensor.restart();
    EXPECT_TRUE(run.poses_flow()) << "after a restart: init id, clock and frame ids begin anew";
    EXPECT_TRUE(run.status_says([](const status_t& s) { return test::counter(s, "restarts") == 1; }));

    sensor.unplug();
    EXPECT_TRUE(run.status_says(health(status_t::WAITING, "no packets")));
    sensor.plug_in();
    EXPECT_TRUE(run.poses_flow());

    sensor.become(on_live_ports({.serial_number = 222}));
    EXPECT_TRUE(run.status_says(sensor_is("OS-0-32 222")));
    EXPECT_TRUE(run.poses_flow()) << "another of the same model";

    const int columns = test::kTooSlowForTimes ? 512 : 1024;
    sensor.become(on_live_ports({.rows = 64, .columns = columns, .serial_number = 333}));
    EXPECT_TRUE(run.status_says(sensor_is("OS-0-64 333")));
    EXPECT_TRUE(run.poses_flow()) << "another model";

    sensor.become(on_live_ports({.rows = 64, .columns = columns, .serial_number = 333, .firmware = "v3.1.0"}));
    EXPECT_TRUE(run.status_says(sensor_is("v3.1.0")));
    EXPECT_TRUE(run.poses_flow());
    EXPECT_TRUE(run.status_says(
        [](const status_t& s) {
            return test::counter(s, "sensor_changes") == 3 && (test::kTooSlowForTimes || s.health == 0);
        },
        25s));
    EXPECT_EQ(run.systemd.messages().find("STOPPING"), std::string::npos);
    run.stop();
}

TEST(SensorChanges, DestinationTakenSettingsAndReload) {
    LiveRun run;
    if (!run.usable()) GTEST_SKIP() << "no multicast here";
    FakeSensor sensor(on_live_ports());
    const std::string host = "host: \"" + sensor.host() + "\"";
    run.write_config(host);
    run.start();
    EXPECT_TRUE(run.poses_flow());

    sensor.set({{"udp_dest", "10.0.0.9"}});
    EXPECT_TRUE(run.status_says(health(status_t::WAITING, "sends to 10.0.0.9")));
    EXPECT_EQ(sensor.settings_made(), 0) << "not without being asked";

    run.write_config(host + ", configure: {udp_dest: '@auto'}", "odometry: {use_imu: off}\n");
    run.daemon->signal(SIGHUP);
    EXPECT_TRUE(run.log_says("now sensor.configure.udp_dest: \"@auto\""));
    EXPECT_TRUE(run.log_says("at the next restart odometry.use_imu: false"));
    EXPECT_TRUE(run.poses_flow()) << "it has taken its destination back";

    run.write_config(host + ", configure: {udp_dst: x}");
    run.daemon->signal(SIGHUP);
    EXPECT_TRUE(run.log_says("the running configuration stays in force"));
    sensor.set({{"udp_dest", "10.0.0.9"}});
    EXPECT_TRUE(run.poses_flow()) << "and does so again";

    const auto recording = run.folder.path() / "recording";
    run.write_config(host, "recording: {folder: " + recording.string() + "}\n");
    run.daemon->signal(SIGHUP);
    EXPECT_TRUE(run.status_says([](const status_t& s) { return test::counter(s, "recorded_packets") > 10; }));
    run.write_config(host);
    run.daemon->signal(SIGHUP);
    EXPECT_TRUE(run.status_says([](const status_t& s) { return test::counter(s, "recorded_packets") == -1; }));
    EXPECT_FALSE(std::filesystem::is_empty(recording));
    run.stop();
}

}  // namespace
}  // namespace dlod
