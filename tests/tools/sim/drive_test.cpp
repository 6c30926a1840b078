#include "tools/sim/drive.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "core/types/lie.hpp"
#include "driver/geometry.hpp"
#include "tests/tools/sim/recorded_drive.hpp"

namespace dlod::tools::sim::test {
namespace {

TEST(Drive, EverySceneScansIsDecodedAndIsTrueToItsPoses) {
    for (const SceneInfo& scene : scenes()) {
        SCOPED_TRACE(std::string(scene.name));
        DriveSettings settings;
        settings.scene = scene.name;
        settings.world.duration_s = 0.2;
        const RecordedDrive drive = record(settings);
        const driver::Geometry geometry(drive.sensor.model);
        const int W = drive.sensor.model.width;
        std::size_t frames = 0;
        const auto counters = decode(drive, [&](Frame& frame) {
            ASSERT_LT(frames, drive.scans.size());
            const Scan& scan = drive.scans[frames++];
            geometry.process(frame);
            double worst_m = 0.0;
            int points = 0;
            for (int r = 0; r < drive.sensor.model.height; ++r) {
                for (int c = 0; c < W; ++c) {
                    ASSERT_EQ(frame.raw.range_mm(r, c), scan.first.range_mm(r, c));
                    ASSERT_EQ(scan.first.range_mm(r, c) == 0, scan.label(r, c) == 0);
                    if (scan.label(r, c) == 0) continue;
                    const auto m = static_cast<std::size_t>(drive.sensor.model.measurement_of(r, c));
                    const double t = static_cast<double>(frame.columns.time_ns[m] - kEpoch_ns) * 1e-9;
                    const Vec3 p =
                        drive.world.robot.T_world_sensor(t) *
                        Eigen::Vector3f(frame.cloud.x(r, c), frame.cloud.y(r, c), frame.cloud.z(r, c)).cast<double>();
                    const Vec3 truth = Eigen::Vector3f(scan.x(r, c), scan.y(r, c), scan.z(r, c)).cast<double>();
                    worst_m = std::max(worst_m, (p - truth).norm());
                    ++points;
                }
            }
            EXPECT_LT(worst_m, 2e-3);
            EXPECT_GT(points, 4000);
        });
        EXPECT_EQ(frames, 2U);
        EXPECT_EQ(counters.incomplete_frames.value(), 0U);
    }
}

TEST(Drive, ObjectsPixelsLieInTheirBoxesWhateverTheColumn) {
    DriveSettings settings;
    settings.scene = "circle";
    settings.noise = false;
    const RecordedDrive drive = record(settings);
    const SensorModel& model = drive.sensor.model;
    int pixels = 0;
    for (const Scan& scan : drive.scans) {
        for (int c = 0; c < model.width; ++c) {
            for (int r = 0; r < model.height; ++r) {
                if (scan.instance(r, c) == 0) continue;
                const int m = model.measurement_of(r, c);
                const double t = scan.start_s + model.frame_period_s * m / model.width;
                const Actor& actor = *drive.world.actors[scan.instance(r, c) - 1U];
                const Vec3 p(Eigen::Vector3f(scan.x(r, c), scan.y(r, c), scan.z(r, c)).cast<double>());
                ASSERT_TRUE(actor.bounds(t, drive.world.shapes).contains(p, 0.01)) << actor.kind() << " at " << t;
                const bool moving = actor.speed(t) > kMovingSpeed_mps;
                EXPECT_EQ(scan.label(r, c) == 2, moving);
                ++pixels;
            }
        }
    }
    EXPECT_GT(pixels, 500);
}

TEST(Drive, WallsStayWhereTheyAreThroughKickAndTurn) {
    DriveSettings settings;
    settings.scene = "tunnel";
    settings.world.movers = false;
    settings.world.duration_s = 1.2;
    settings.world.robot.kicks_s = {0.2};
    settings.world.robot.turns_s = {0.3};
    const RecordedDrive drive = record(settings);
    double sum = 0.0;
    double squares = 0.0;
    int count = 0;
    for (const Scan& scan : drive.scans) {
        for (std::size_t i = 0; i < scan.label.size(); ++i) {
            const bool wall = scan.label[i] == 1 && scan.z[i] > 0.3F && scan.z[i] < 2.2F && std::abs(scan.x[i]) < 8.0F;
            if (!wall) continue;
            const double error = std::abs(static_cast<double>(scan.y[i])) - 3.0;
            sum += error;
            squares += error * error;
            ++count;
        }
    }
    ASSERT_GT(count, 10000);
    EXPECT_LT(std::abs(sum / count), 1e-3);
    EXPECT_LT(std::sqrt(squares / count), 0.02);  // what the range noise leaves
    EXPECT_GT(std::sqrt(squares / count), 0.003);
}

TEST(Drive, TheSameSeedGivesTheSameBytesWhateverTheThreads) {
    DriveSettings settings;
    settings.world.duration_s = 0.4;
    settings.faults.loss = 0.02;
    settings.faults.reordering = 0.1;
    settings.threads = 1;
    const RecordedDrive one = record(settings);
    settings.threads = 3;
    const RecordedDrive three = record(settings);
    ASSERT_EQ(one.datagrams.size(), three.datagrams.size());
    for (std::size_t i = 0; i < one.datagrams.size(); ++i) {
        ASSERT_EQ(one.datagrams[i].bytes, three.datagrams[i].bytes);
        ASSERT_EQ(one.datagrams[i].send_ns, three.datagrams[i].send_ns);
    }
    settings.world.seed = 6;
    const RecordedDrive other = record(settings);
    EXPECT_FALSE(std::equal(one.datagrams.begin(), one.datagrams.end(), other.datagrams.begin(), other.datagrams.end(),
                            [](const Datagram& a, const Datagram& b) { return a.bytes == b.bytes; }));
}

// Each beam has errors of its own that stay the same, and leaves show another face each time.
TEST(Drive, RoughMeasurementsAreOffByTheBeamAndScatteredByLeaves) {
    DriveSettings settings;
    settings.scene = "slope";
    settings.sensor = "OS0-32";
    settings.world.movers = false;
    settings.world.duration_s = 0.3;
    settings.world.robot = {.speed_mps = 0.0, .wobble = false};
    const RecordedDrive smooth = record(settings);
    settings.rough = true;
    const RecordedDrive rough = record(settings);
    const int rows = smooth.sensor.model.height;
    double apart = 0.0;
    for (int row = 0; row < rows; ++row) {
        double bias[2] = {};
        for (const int turn : {0, 1}) {
            std::vector<double> difference_m;
            const auto& a = smooth.scans[static_cast<std::size_t>(turn)].first.range_mm;
            const auto& b = rough.scans[static_cast<std::size_t>(turn)].first.range_mm;
            for (int c = 0; c < a.width(); ++c) {
                if (a(row, c) != 0 && b(row, c) != 0)
                    difference_m.push_back((static_cast<double>(b(row, c)) - static_cast<double>(a(row, c))) * 1e-3);
            }
            ASSERT_GT(difference_m.size(), 50U) << "row " << row;
            const auto middle = difference_m.begin() + static_cast<std::ptrdiff_t>(difference_m.size() / 2);
            std::nth_element(difference_m.begin(), middle, difference_m.end());
            bias[turn] = *middle;
        }
        EXPECT_LT(std::abs(bias[0]), 0.1) << "row " << row;
        EXPECT_NEAR(bias[0], bias[1], 0.02) << "row " << row;
        apart += std::abs(bias[0]) / rows;
    }
    EXPECT_GT(apart, 0.003);
    // Standing still, few ranges change by much from turn to turn but those of leaves and strays.
    const auto changes = [](const RecordedDrive& drive) {
        int count = 0;
        const auto& a = drive.scans[0].first.range_mm;
        const auto& b = drive.scans[1].first.range_mm;
        for (std::size_t i = 0; i < a.size(); ++i) {
            if (a[i] != 0 && b[i] != 0)
                count += std::abs(static_cast<double>(a[i]) - static_cast<double>(b[i])) > 300.0 ? 1 : 0;
        }
        return count;
    };
    EXPECT_GT(changes(rough), 3 * changes(smooth) + 20);
}

// Even ground at a given altitude: a pulse that is off by an angle is off in range by that times range / tan(altitude).
TEST(Drive, PulsesOffTheGridMissTheirPixelsDirection) {
    DriveSettings settings;
    settings.world.movers = false;
    settings.world.duration_s = 0.3;
    settings.world.robot = {.speed_mps = 0.0, .wobble = false};
    const auto median_change_m = [](const RecordedDrive& drive) {
        const auto& a = drive.scans[0].first.range_mm;
        const auto& b = drive.scans[1].first.range_mm;
        std::vector<double> change_m;
        for (int c = 0; c < a.width(); ++c) {
            const int row = a.height() - 1;
            if (a(row, c) != 0 && b(row, c) != 0)
                change_m.push_back(std::abs(static_cast<double>(a(row, c)) - static_cast<double>(b(row, c))) * 1e-3);
        }
        const auto middle = change_m.begin() + static_cast<std::ptrdiff_t>(change_m.size() / 2);
        std::nth_element(change_m.begin(), middle, change_m.end());
        return *middle;
    };
    const RecordedDrive on_grid = record(settings);
    settings.off_grid_rad = 0.005;
    const RecordedDrive off_grid = record(settings);
    const double altitude = std::abs(static_cast<double>(on_grid.sensor.model.altitude_rad.back()));
    const double range_m = 1.2 / std::sin(altitude);
    // Of the difference of two evenly spread errors half are below .59 of the largest of one.
    const double expected_m = 0.59 * settings.off_grid_rad * range_m / std::tan(altitude);
    EXPECT_LT(median_change_m(on_grid), 0.5 * expected_m);
    EXPECT_NEAR(median_change_m(off_grid), expected_m, 0.25 * expected_m);
}

TEST(Drive, NobodyIsThereWithoutMovers) {
    DriveSettings settings;
    settings.world.movers = false;
    settings.world.duration_s = 0.1;
    for (const SceneInfo& scene : scenes()) {
        settings.scene = scene.name;
        const RecordedDrive drive = record(settings);
        EXPECT_TRUE(drive.world.actors.empty());
        for (const Scan& scan : drive.scans) {
            EXPECT_EQ(std::count_if(scan.instance.data(), scan.instance.data() + scan.instance.size(),
                                    [](std::uint16_t id) { return id != 0; }),
                      0);
        }
    }
}

TEST(Drive, EveryProfileAndModeIsEncodedAndDecoded) {
    for (const driver::PacketFormat& format : driver::packet_formats()) {
        SCOPED_TRACE(std::string(format.name));
        DriveSettings settings;
        settings.profile = format.name;
        settings.sensor = "OS0-64";
        settings.mode = "512x20";
        settings.world.duration_s = 0.1;
        const RecordedDrive drive = record(settings);
        std::size_t frames = 0;
        decode(drive, [&](Frame& frame) {
            const Scan& scan = drive.scans[frames++];
            std::size_t returns = 0;
            for (std::size_t i = 0; i < scan.label.size(); ++i) {
                ASSERT_EQ(frame.raw.range_mm[i], scan.first.range_mm[i]);
                if (scan.first.range_mm[i] == 0) continue;
                ASSERT_EQ(frame.raw.reflectivity[i], scan.first.reflectivity[i]);
                ++returns;
            }
            EXPECT_GT(returns, scan.label.size() / 3);
        });
        EXPECT_EQ(frames, 2U);
    }
}

TEST(Drive, FaultsAppearAndAreInTheTruth) {
    DriveSettings settings;
    settings.world.duration_s = 1.0;
    settings.faults.loss = 0.05;
    settings.faults.duplication = 0.05;
    settings.faults.reordering = 0.05;
    settings.faults.corruption = 0.05;
    settings.faults.sectors_deg = {{350.0, 10.0}};
    const RecordedDrive drive = record(settings);
    std::array<std::uint64_t, 5> drawn{};
    for (const auto& turn : drive.packets) {
        for (const PacketRecord& p : turn) ++drawn[static_cast<std::size_t>(p.fault)];
    }
    for (const std::uint64_t count : drawn) EXPECT_GT(count, 0U);
    std::size_t frames = 0;
    const auto counters = decode(drive, [&](Frame& frame) {
        const Scan& scan = drive.scans[frames++];
        for (std::size_t i = 0; i < scan.label.size(); ++i) {
            ASSERT_EQ(frame.raw.range_mm[i] == 0, scan.label[i] == 0);
            ASSERT_EQ(frame.raw.range_mm[i], scan.first.range_mm[i]);
        }
    });
    EXPECT_EQ(frames, drive.scans.size());
    EXPECT_EQ(counters.duplicate_packets.value(), drawn[static_cast<std::size_t>(PacketFault::kDuplicated)]);
    EXPECT_GT(counters.lost_packets.value(), 0U);
    EXPECT_GT(counters.reordered_packets.value(), 0U);
    EXPECT_GT(counters.invalid_columns.value(), 0U);
    EXPECT_GT(
        counters.wrong_size_packets.value() + counters.wrong_type_packets.value() + counters.foreign_packets.value(),
        0U);
}

TEST(Drive, ARestartChangesTheInitIdAndAGapSilencesAll) {
    DriveSettings settings;
    settings.world.duration_s = 2.0;
    settings.faults.restarts_s = {0.43};
    settings.faults.gaps_s = {{1.3, 0.3}};
    const RecordedDrive drive = record(settings);
    for (const Datagram& d : drive.datagrams) {
        const double t = static_cast<double>(d.send_ns - kEpoch_ns) * 1e-9;
        EXPECT_FALSE(t > 0.46 && t < 0.95) << "while the sensor was away";
        EXPECT_FALSE(t > 1.33 && t < 1.6) << "in the gap";
    }
    const auto counters = decode(drive, [](Frame&) {});
    EXPECT_EQ(counters.restarts.value(), 1U);
    EXPECT_GT(counters.frames.value(), 8U);
}

}  // namespace
}  // namespace dlod::tools::sim::test
