// A service whose sensor has not come yet.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

#include "tests/daemon/live/live_run.hpp"
#include "tests/support/fake_sensor.hpp"

namespace dlod {
namespace {

using namespace std::chrono_literals;
using test::LiveRun;

/// What `dlod command` prints, and its exit code.
struct Answer {
    int code = -1;
    std::string text;
};
Answer tell(const LiveRun& run, const std::vector<std::string>& command) {
    std::vector<std::string> line = {DLOD_BINARY, "command"};
    line.insert(line.end(), command.begin(), command.end());
    line.insert(line.end(), {"-c", run.config().string()});
    test::ChildProcess child(line);
    const auto code = child.wait(test::kTooSlowForTimes ? 30s : 10s);
    return {code.value_or(-1), child.output()};
}

TEST(Waiting, CommandsAreAnsweredBeforeAndAfterTheSensorHasCome) {
    LiveRun run;
    if (!run.usable()) GTEST_SKIP() << "no multicast here";
    test::FakeSensor sensor(test::on_live_ports());
    sensor.unplug();
    run.write_config("host: \"" + sensor.host() + "\"");
    run.start();
    const auto map = tell(run, {"save-map", "hall"});
    EXPECT_EQ(map.code, 1);
    EXPECT_NE(map.text.find("waits for its sensor"), std::string::npos) << map.text;
    EXPECT_EQ(tell(run, {"restart-odometry"}).code, 0);
    const auto level = tell(run, {"log-level", "debug"});
    EXPECT_EQ(level.code, 0) << level.text;
    EXPECT_NE(level.text.find("now debug"), std::string::npos) << level.text;
    EXPECT_TRUE(run.status_says([](const status_t& s) { return test::counter(s, "commands") == 3; }));

    sensor.plug_in();
    EXPECT_TRUE(run.poses_flow());
    Answer restart = tell(run, {"restart-odometry"});
    const auto has_begun = [&] { return restart.text.find("has begun anew") != std::string::npos; };
    if (test::kTooSlowForTimes) {  // a frame may take longer than the answer waits for one
        run.eventually(10s, [&] {
            if (!has_begun()) restart = tell(run, {"restart-odometry"});
            return has_begun();
        });
    }
    EXPECT_EQ(restart.code, 0) << restart.text;
    EXPECT_TRUE(has_begun()) << restart.text;
    run.stop();
}

TEST(Waiting, ItIsReadyWithMetadataAndWithoutANetworkForTheMessages) {
    LiveRun run;
    if (!run.usable() || !run.has_own_network()) GTEST_SKIP() << "the host's routes are not touched";
    ASSERT_EQ(std::system("ip route del 224.0.0.0/4 dev lo"), 0);
    const auto metadata = run.folder.path() / "sensor.json";
    std::ofstream(metadata) << test::SyntheticCapture::metadata(test::on_live_ports());
    run.write_config("metadata: " + metadata.string());
    run.start();  // until READY: systemd would end a service that is not, for want of it
    EXPECT_TRUE(run.systemd.wait_for("LCM cannot be opened", 5s));
    std::this_thread::sleep_for(3s);  // some attempts
    const std::string log = run.daemon->output();
    EXPECT_LT(std::count(log.begin(), log.end(), '\n'), 10) << "said once, not with each attempt:\n" << log;
    ASSERT_EQ(std::system("ip route add 224.0.0.0/4 dev lo"), 0);
    EXPECT_TRUE(run.log_says("receiving on port", 10s));
    run.stop();
}

}  // namespace
}  // namespace dlod
