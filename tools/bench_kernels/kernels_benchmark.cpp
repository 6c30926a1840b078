// The kernels one by one, on made-up input of a 128 x 1024 sensor: a square with walls, pillars and people.
#include <benchmark/benchmark.h>

#include <numbers>
#include <vector>

#include "core/preprocess/subsampling.hpp"
#include "core/registration/placed_points.hpp"
#include "core/registration/scan_to_submap.hpp"
#include "core/segmentation/ground_removal.hpp"
#include "core/segmentation/range_image_segmentation.hpp"
#include "core/tracking/association.hpp"
#include "driver/geometry.hpp"
#include "tests/driver/synthetic_sensor.hpp"
#include "tests/support/rendered_scene.hpp"

namespace dlod {
namespace {

constexpr int kRows = 128;
constexpr int kColumns = 1024;
constexpr double kDegree_rad = std::numbers::pi / 180.0;

const SensorModel& sensor() {
    static const SensorModel model = test::even_sensor(kRows, kColumns, 45.0 * kDegree_rad, -45.0 * kDegree_rad);
    return model;
}

/// Range from a sensor 1.2 m above the ground in a square of 40 m x 30 m with 30 people-sized boxes.
double square_scene(const Eigen::Vector3d& o, const Eigen::Vector3d& d) {
    double range = test::plane_range(-Eigen::Vector3d::UnitZ(), 1.2, o, d);
    for (const auto& [normal, offset] : {std::pair{Eigen::Vector3d(Eigen::Vector3d::UnitX()), 20.0},
                                         {Eigen::Vector3d(-Eigen::Vector3d::UnitX()), 20.0},
                                         {Eigen::Vector3d(Eigen::Vector3d::UnitY()), 15.0},
                                         {Eigen::Vector3d(-Eigen::Vector3d::UnitY()), 15.0}}) {
        range = test::nearest(range, test::plane_range(normal, offset, o, d));
    }
    for (int i = 0; i < 30; ++i) {
        const double direction = i * 12.0 * kDegree_rad;
        const double distance = 4.0 + (i * 7) % 9;
        const Eigen::Vector3d foot(distance * std::cos(direction), distance * std::sin(direction), -1.2);
        range = test::nearest(range, test::box_range(foot - Eigen::Vector3d(0.25, 0.25, 0.0),
                                                     foot + Eigen::Vector3d(0.25, 0.25, 1.7), o, d));
    }
    return range;
}

/// A frame of the scene, with the registration's points.
Frame& scene_frame() {
    static Frame frame = [] {
        Frame made(sensor());
        test::render(sensor(), square_scene, Eigen::Isometry3d::Identity(), made);
        GroundRemoval(sensor(), {}).process(made);
        Subsampling(sensor(), {}).process(made);
        return made;
    }();
    return frame;
}

void decode(benchmark::State& state) {
    const driver::test::SyntheticSensor sender({.rows = kRows, .columns = kColumns});
    std::vector<std::vector<std::byte>> packets;
    constexpr std::uint32_t kFrames = 4;  // one after the other, again and again
    for (std::uint32_t id = 1; id <= kFrames; ++id) {
        for (int i = 0; i < sender.packets_per_frame(); ++i) packets.push_back(sender.packet(id, i));
    }
    std::vector<std::unique_ptr<Frame>> pool;
    std::vector<Frame*> free;
    for (int i = 0; i < 3; ++i) free.push_back(pool.emplace_back(std::make_unique<Frame>(sender.info().model)).get());
    for (auto _ : state) {
        driver::FrameBuilder builder(
            sender.info(), {},
            [&] {
                Frame* frame = free.back();
                free.pop_back();
                return frame;
            },
            [&](Frame* frame) { free.push_back(frame); });
        for (const auto& data : packets) {
            driver::Packet packet;
            packet.data = data;
            packet.destination_port = sender.info().lidar_port;
            builder.push(packet);
        }
        builder.flush();
        if (builder.counters().frames.value() != kFrames) state.SkipWithError("frames were lost");
    }
    state.counters["frame"] =
        benchmark::Counter(kFrames, benchmark::Counter::kIsIterationInvariantRate | benchmark::Counter::kInvert);
}
BENCHMARK(decode)->Unit(benchmark::kMillisecond);

void geometry(benchmark::State& state) {
    Frame frame = scene_frame();
    const driver::Geometry kernel(sensor());
    for (auto _ : state) kernel.process(frame);
}
BENCHMARK(geometry)->Unit(benchmark::kMillisecond);

void subsampling(benchmark::State& state) {
    Frame frame = scene_frame();
    Subsampling kernel(sensor(), {});
    for (auto _ : state) kernel.process(frame);
    state.counters["points"] = static_cast<double>(frame.prepared.points.size());
}
BENCHMARK(subsampling)->Unit(benchmark::kMillisecond);

void ground_removal(benchmark::State& state) {
    Frame frame = scene_frame();
    GroundRemoval kernel(sensor(), {});
    for (auto _ : state) kernel.process(frame);
}
BENCHMARK(ground_removal)->Unit(benchmark::kMillisecond);

void segmentation(benchmark::State& state) {
    Frame frame = scene_frame();
    RangeImageSegmentation kernel(sensor(), {});
    for (auto _ : state) kernel.process(frame);
    state.counters["segments"] = static_cast<double>(frame.prepared.segments.size());
}
BENCHMARK(segmentation)->Unit(benchmark::kMillisecond);

/// One iteration of the second stage: counterparts in the submap, then the normal equations.
void registration_step(benchmark::State& state) {
    const PointSelection& points = scene_frame().prepared.points;
    std::vector<FixedPoint> fixed;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const auto position = [](float v) { return static_cast<std::int32_t>(static_cast<double>(v) / kMapUnit_m); };
        const auto normal = [](float v) { return static_cast<std::int16_t>(v * static_cast<float>(kNormalUnits)); };
        fixed.push_back({position(points.x[i]), position(points.y[i]), position(points.z[i]), normal(points.nx[i]),
                         normal(points.ny[i]), normal(points.nz[i])});
    }
    VoxelMap map({});
    map.add(fixed);
    SweepMotion standing{};
    for (auto& pose : standing.rows) pose[0] = pose[5] = pose[10] = 1.0F;
    const std::vector<std::uint8_t> excluded(points.size(), 0);
    const ScanToSubmap kernel({});
    PlaneMatches matches;
    matches.reserve(points.size());
    NormalEquations equations;
    PlacedPoints placed;
    for (auto _ : state) {
        matches.clear();
        place(points, standing, placed);
        kernel.match(points, excluded, placed, map, VoxelIndex{}, 1.0, matches);
        accumulate(matches, equations);
    }
    state.counters["matches"] = static_cast<double>(equations.count);
}
BENCHMARK(registration_step)->Unit(benchmark::kMillisecond);

/// As many tracks as detections, on a grid in which each has neighbours within its gate.
void association(benchmark::State& state) {
    const auto count = static_cast<int>(state.range(0));
    std::vector<KalmanFilter> filters;
    filters.reserve(static_cast<std::size_t>(count));
    std::vector<ExpectedTrack> tracks;
    std::vector<CandidateDetection> detections;
    for (int i = 0; i < count; ++i) {
        BoxMeasurement seen;
        seen.box.center_m = {i % 6 * 0.8, i / 6 * 0.8, 0.0};
        seen.box.size_m = {0.6, 0.5, 1.7};
        filters.emplace_back(seen, KalmanConfig{});
        tracks.push_back(
            {.visible = seen.box, .whole = seen.box, .filter = &filters.back(), .points = 100, .dt_s = 0.1});
        detections.push_back({.visible = seen.box, .points = 100});
        detections.back().visible.center_m.x() += 0.1;
    }
    Association kernel;
    const AssociationConfig config;
    for (auto _ : state) benchmark::DoNotOptimize(kernel.solve(tracks, detections, config).data());
}
BENCHMARK(association)->Arg(30)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace dlod

BENCHMARK_MAIN();
