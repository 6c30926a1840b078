#include "daemon/clock/host_time_filter.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

namespace dlod::daemon {
namespace {

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kSecond = 1'000'000'000;

/// A sensor with its own epoch and a drifting clock behind a network whose delay has a floor and a heavy tail.
class Simulation {
  public:
    Simulation(double drift_ppm, std::uint64_t seed) : drift_(drift_ppm * 1e-6), random_(seed) {}

    std::int64_t sensor_ns(std::int64_t host_ns) const {
        return kSensorEpoch + (host_ns - kHostEpoch) +
               static_cast<std::int64_t>(drift_ * static_cast<double>(host_ns - kHostEpoch));
    }
    std::int64_t delay_ns() {
        std::exponential_distribution<double> usual(1.0 / 0.3e6);
        std::uniform_real_distribution<double> chance(0.0, 1.0);
        const double burst = chance(random_) < 0.05 ? 30e6 * chance(random_) : 0.0;
        return static_cast<std::int64_t>(usual(random_) + burst);
    }

    static constexpr std::int64_t kHostEpoch = 1'700'000'000 * kSecond;
    static constexpr std::int64_t kSensorEpoch = 12'345 * kSecond;  // since the sensor's boot

  private:
    double drift_;
    std::mt19937_64 random_;
};

/// Feeds 64 packets a frame at 10 Hz; returns the largest error of the stamp after `settle` frames.
double worst_error_ms(HostTimeFilter& filter, Simulation& sim, int frames, int settle, std::int64_t start_ns = 0) {
    double worst = 0.0;
    for (int f = 0; f < frames; ++f) {
        std::int64_t host = 0;
        for (int p = 0; p < 64; ++p) {
            host = Simulation::kHostEpoch + start_ns + f * 100 * kMs + p * 100 * kMs / 64;
            filter.add(sim.sensor_ns(host), host + sim.delay_ns());
        }
        const double error = static_cast<double>(filter.next_stamp_ns(sim.sensor_ns(host)) - host) * 1e-6;
        if (f >= settle) worst = std::max(worst, std::abs(error));
    }
    return worst;
}

TEST(HostTimeFilter, JitterStaysBelowAMillisecondUnderDriftAndQueueing) {
    for (const double ppm : {-80.0, -10.0, 0.0, 35.0, 80.0}) {
        Simulation sim(ppm, 7);
        HostTimeFilter filter;
        EXPECT_LT(worst_error_ms(filter, sim, 3000, 10), 0.5) << ppm << " ppm";
        EXPECT_NEAR(filter.drift_ppm(), -ppm, 5.0);
    }
}

TEST(HostTimeFilter, StampsNeverGoBackwards) {
    Simulation sim(50.0, 3);
    HostTimeFilter filter;
    std::int64_t last = INT64_MIN;
    for (int i = 0; i < 20000; ++i) {
        const std::int64_t host = Simulation::kHostEpoch + i * 2 * kMs;
        filter.add(sim.sensor_ns(host), host + sim.delay_ns());
        const std::int64_t stamp = filter.next_stamp_ns(sim.sensor_ns(host));
        ASSERT_GT(stamp, last);
        last = stamp;
    }
}

TEST(HostTimeFilter, AForwardStepIsReportedAndFollowed) {
    Simulation sim(0.0, 5);
    HostTimeFilter filter;
    worst_error_ms(filter, sim, 100, 10);
    EXPECT_FALSE(filter.take_step().happened);
    for (int i = 0; i < 3000; ++i) {
        const std::int64_t host = Simulation::kHostEpoch + 10 * kSecond + i * kMs;
        filter.add(sim.sensor_ns(host), host + 3600 * kSecond + sim.delay_ns());
    }
    const auto step = filter.take_step();
    EXPECT_TRUE(step.happened);
    EXPECT_TRUE(step.followed);
    EXPECT_NEAR(static_cast<double>(step.by_ns) * 1e-9, 3600.0, 0.1);
    EXPECT_FALSE(filter.take_step().happened) << "reported once";
    const std::int64_t host = Simulation::kHostEpoch + 13 * kSecond;
    EXPECT_NEAR(static_cast<double>(filter.to_host_ns(sim.sensor_ns(host)) - host) * 1e-9, 3600.0, 0.001);
}

TEST(HostTimeFilter, ABackwardStepIsReportedAndTimeGoesOnAlongTheOldScale) {
    Simulation sim(0.0, 5);
    HostTimeFilter filter;
    worst_error_ms(filter, sim, 100, 10);
    for (int f = 0; f < 50; ++f) {
        const std::int64_t host = Simulation::kHostEpoch + 10 * kSecond + f * 100 * kMs;
        filter.add(sim.sensor_ns(host), host - 3600 * kSecond + sim.delay_ns());
        EXPECT_NEAR(static_cast<double>(filter.next_stamp_ns(sim.sensor_ns(host)) - host) * 1e-6, 0.0, 35.0);
    }
    const auto step = filter.take_step();
    EXPECT_TRUE(step.happened);
    EXPECT_FALSE(step.followed);
    EXPECT_NEAR(static_cast<double>(step.by_ns) * 1e-9, -3600.0, 0.1);
}

TEST(HostTimeFilter, APassingDelayIsNoStep) {
    Simulation sim(0.0, 11);
    HostTimeFilter filter;
    worst_error_ms(filter, sim, 100, 10);
    for (int i = 0; i < 64 * 10; ++i) {  // a second during which the network holds everything back by 200 ms
        const std::int64_t host = Simulation::kHostEpoch + 10 * kSecond + i * kSecond / 640;
        filter.add(sim.sensor_ns(host), host + 200 * kMs);
    }
    EXPECT_LT(worst_error_ms(filter, sim, 100, 0, 11 * kSecond), 0.5);
    EXPECT_FALSE(filter.take_step().happened);
}

TEST(HostTimeFilter, ABurstAtTheStartOfAStreamIsNoStep) {
    // What a network had held back comes at once: the first packets are late by as long as they have waited.
    for (const std::int64_t held_ns : {51 * kMs, 120 * kMs, 700 * kMs, 1900 * kMs}) {
        const Simulation sim(0.0, 5);
        HostTimeFilter filter;
        std::int64_t last = 0;
        for (int f = 0; f < 100; ++f) {
            const std::int64_t host = Simulation::kHostEpoch + f * 100 * kMs;
            const std::int64_t received = std::max(host, Simulation::kHostEpoch + held_ns);
            filter.add(sim.sensor_ns(host), received);
            const std::int64_t stamp = filter.next_stamp_ns(sim.sensor_ns(host));
            EXPECT_GE(stamp, host);
            // What was given too late is made up for, but no two stamps come close.
            EXPECT_TRUE(f == 0 || stamp - last >= 50 * kMs) << stamp - last;
            EXPECT_TRUE(stamp == host || host < Simulation::kHostEpoch + 2 * held_ns) << held_ns / kMs << " ms, " << f;
            last = stamp;
        }
        EXPECT_FALSE(filter.take_step().happened) << held_ns / kMs << " ms";
    }
}

TEST(HostTimeFilter, AClockSetBackByMoreThanAnyDelayIsAStepFromTheStart) {
    const Simulation sim(0.0, 5);
    HostTimeFilter filter;
    for (int f = 0; f < 10; ++f) {
        const std::int64_t host = Simulation::kHostEpoch + f * 100 * kMs;
        filter.add(sim.sensor_ns(host), f < 5 ? host : host - 3600 * kSecond);
        filter.next_stamp_ns(sim.sensor_ns(host));
    }
    const auto step = filter.take_step();
    EXPECT_TRUE(step.happened);
    EXPECT_NEAR(static_cast<double>(step.by_ns) * 1e-9, -3600.0, 0.1);
}

TEST(HostTimeFilter, ASensorThatStartsAnewHasItsTimeAtOnce) {
    const Simulation sim(0.0, 5);
    HostTimeFilter filter;
    for (int f = 0; f < 200; ++f) {
        const bool restarted = f >= 100;
        // Half a minute passes before it comes back, its clock at zero.
        const std::int64_t host = Simulation::kHostEpoch + f * 100 * kMs + (restarted ? 30 * kSecond : 0);
        const std::int64_t sensor = restarted ? (f - 99) * 100 * kMs : sim.sensor_ns(host);
        filter.add(sensor, host);
        EXPECT_NEAR(static_cast<double>(filter.next_stamp_ns(sensor) - host) * 1e-6, 0.0, 1.0) << f;
        EXPECT_EQ(filter.take_step().happened, f == 100);
    }
}

TEST(HostTimeFilter, AClockSetBackAndForthLeavesTheHostsTime) {
    Simulation sim(0.0, 5);
    HostTimeFilter filter;
    std::int64_t last = 0;
    for (int f = 0; f < 300; ++f) {
        const std::int64_t host = Simulation::kHostEpoch + f * 100 * kMs;
        const std::int64_t set = f >= 100 && f < 200 ? -3600 * kSecond : 0;
        filter.add(sim.sensor_ns(host), host + set + sim.delay_ns());
        const std::int64_t stamp = filter.next_stamp_ns(sim.sensor_ns(host));
        EXPECT_GT(stamp, last);
        EXPECT_NEAR(static_cast<double>(stamp - host) * 1e-6, 0.0, 35.0) << f;
        last = stamp;
    }
}

TEST(HostTimeFilter, AStepBackLaterOnIsOneHoweverSmall) {
    Simulation sim(0.0, 5);
    HostTimeFilter filter;
    worst_error_ms(filter, sim, 30, 10);
    for (int f = 30; f < 40; ++f) {
        const std::int64_t host = Simulation::kHostEpoch + f * 100 * kMs;
        filter.add(sim.sensor_ns(host), host - 80 * kMs);
    }
    const auto step = filter.take_step();
    EXPECT_TRUE(step.happened);
    EXPECT_NEAR(static_cast<double>(step.by_ns) * 1e-6, -80.0, 1.0);
}

/// As with two PTP masters, one of which tells TAI and the other UTC.
TEST(HostTimeFilter, ASensorsClockThatIsSetToAndFroLeavesUtimeAtTheHosts) {
    for (const int frames : {3, 5, 12, 40}) {
        Simulation sim(0.0, 5);
        HostTimeFilter filter;
        std::int64_t last = 0;
        for (int f = 0; f < 500; ++f) {
            const std::int64_t host = Simulation::kHostEpoch + f * 100 * kMs;
            const std::int64_t sensor = sim.sensor_ns(host) + (f / frames % 2 == 0 ? 0 : 37 * kSecond);
            filter.add(sensor, host + sim.delay_ns());
            const std::int64_t stamp = filter.next_stamp_ns(sensor);
            EXPECT_GT(stamp, last);
            EXPECT_NEAR(static_cast<double>(stamp - host) * 1e-6, 0.0, 35.0) << frames << ", frame " << f;
            last = stamp;
        }
    }
}

TEST(HostTimeFilter, ASensorSetForwardWhileTheHostIsSetBackDoesNotTakeUtimeAlong) {
    const Simulation sim(0.0, 5);
    HostTimeFilter filter;
    std::int64_t stamp = 0;
    for (int f = 0; f < 100; ++f) {
        const std::int64_t host = Simulation::kHostEpoch + f * 100 * kMs;
        const std::int64_t sensor = sim.sensor_ns(host) + (f < 50 ? 0 : 1'700'000'000 * kSecond);
        filter.add(sensor, f < 50 ? host : host - 3600 * kSecond);
        const std::int64_t before = stamp;
        stamp = filter.next_stamp_ns(sensor);
        EXPECT_GT(stamp, before);
        EXPECT_NEAR(1e-9 * static_cast<double>(stamp - host), 0.0, 61.0) << f;
    }
}

TEST(HostTimeFilter, AnotherSensorsStampsGoOnAtTheHostsTime) {
    const Simulation sim(0.0, 5);
    HostTimeFilter filter;
    std::int64_t last = 0;
    for (int f = 0; f < 100; ++f) {
        if (f % 20 == 0) filter = filter.for_another_sensor();
        const std::int64_t host = Simulation::kHostEpoch + f * 100 * kMs;
        filter.add(sim.sensor_ns(host), host);
        const std::int64_t stamp = filter.next_stamp_ns(sim.sensor_ns(host));
        EXPECT_GT(stamp, last);
        EXPECT_EQ(stamp, host) << f;
        last = stamp;
    }
}

TEST(HostTimeFilter, TimesAtTheEndsOfWhatASensorMaySendDoNotOverflow) {
    constexpr std::int64_t kLatest = (std::int64_t{1} << 62U) - 1;
    HostTimeFilter filter;
    std::int64_t host = Simulation::kHostEpoch;
    std::int64_t last = 0;
    for (const std::int64_t sensor : {std::int64_t{0}, kLatest, std::int64_t{0}, kLatest - kSecond, kLatest / 2}) {
        for (int i = 0; i < 30; ++i) {
            host += 100 * kMs;
            filter.add(std::min(sensor + i * 100 * kMs, kLatest), host);
            const std::int64_t stamp = filter.next_stamp_ns(std::min(sensor + i * 100 * kMs, kLatest));
            EXPECT_GT(stamp, last) << sensor << " " << i;
            last = stamp;
        }
        EXPECT_NEAR(1e-9 * static_cast<double>(last - host), 0.0, 5.0) << "after seconds it is the host's time again";
    }
}

}  // namespace
}  // namespace dlod::daemon
