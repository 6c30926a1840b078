#include "core/preprocess/subsampling.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <numeric>
#include <set>
#include <tuple>

#include "tests/support/pcl_reference.hpp"
#include "tests/support/simulated_drive.hpp"

namespace dlod::test {
namespace {

Eigen::Isometry3d at_rest(double) {
    return Eigen::Isometry3d(Eigen::Translation3d(0.3, -0.2, 0.1));
}

Eigen::Vector3f pixel_point(const Frame& frame, PixelIndex p) {
    return {frame.cloud.x[p], frame.cloud.y[p], frame.cloud.z[p]};
}

Eigen::Vector3f selected_point(const PointSelection& points, std::size_t i) {
    return {points.x[i], points.y[i], points.z[i]};
}

Eigen::Vector3f normal(const PointSelection& points, std::size_t i) {
    return {points.nx[i], points.ny[i], points.nz[i]};
}

/// Of the simulated sensor, whose beams' azimuths span 0.1 rad, in columns.
constexpr double kMostColumnsApart = 20.0;

/// One frame of a room, taken at rest.
struct Room {
    explicit Room(const DriveOptions& options, std::vector<SceneBox> scene = furnished_room())
        : drive(std::move(scene), at_rest, options), frame(drive.sensor()) {
        drive.fill(0, frame);
    }
    const PointSelection& select(const SubsamplingConfig& config) {
        Subsampling(drive.sensor(), config).process(frame);
        return frame.prepared.points;
    }
    SimulatedDrive drive;
    Frame frame;
};

DriveOptions resolution(int height, int width) {
    DriveOptions options;
    options.height = height;
    options.width = width;
    return options;
}

/// Takes every candidate, whatever it is.
SubsamplingConfig all_candidates() {
    SubsamplingConfig config;
    config.points = 50000;
    config.least_points = 0;
    config.spacing_m = 0.0;
    config.rough_points = 50000;
    return config;
}

class Resolutions : public testing::TestWithParam<std::pair<int, int>> {
  protected:
    Resolutions() : room(resolution(GetParam().first, GetParam().second)) {}
    Room room;
};

// The reference read indices of the full grid from a cloud that had been compacted before.
TEST_P(Resolutions, EveryPointKnowsThePixelThatItComesFrom) {
    const int width = GetParam().second;
    room.drive.column_arrives = [](int, int m) { return m % 50 != 7; };
    room.drive.fill(1, room.frame);
    for (PixelIndex p = 0; p < room.frame.raw.range_mm.size(); p += 37) {
        room.frame.raw.range_mm[p] = 0;
        for (auto* image : {&room.frame.cloud.range_m, &room.frame.cloud.x, &room.frame.cloud.y, &room.frame.cloud.z})
            (*image)[p] = 0.0F;
    }
    const PointSelection& points = room.select(SubsamplingConfig{});
    ASSERT_GT(points.size(), 200U);
    std::set<PixelIndex> seen;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const PixelIndex p = points.pixel[i];
        EXPECT_TRUE(seen.insert(p).second) << "pixel " << p << " twice";
        ASSERT_GT(room.frame.raw.range_mm[p], 0U);
        const int m = room.drive.sensor().measurement_of(static_cast<int>(p) / width, static_cast<int>(p) % width);
        EXPECT_EQ(points.measurement[i], m);
        ASSERT_NE(m % 50, 7);
        const double time_s =
            static_cast<double>(room.frame.columns.time_ns[static_cast<std::size_t>(m)] - room.frame.header.stamp_ns) *
            1e-9;
        // That of a window is a mean over its rows, which are fired some columns apart.
        EXPECT_NEAR(static_cast<double>(points.time_s[i]), time_s,
                    normal(points, i).isZero() ? 1e-6 : kMostColumnsApart * 0.1 / width);
        EXPECT_LE(points.time_s[i], 0.0F);
        const Eigen::Vector3f shift = selected_point(points, i) - pixel_point(room.frame, p);
        if (normal(points, i).isZero()) {
            EXPECT_EQ(shift.norm(), 0.0F);
        } else {
            // Smoothed along its beam, by about the noise; across it, the mean of its beams' origins counts.
            EXPECT_LT(shift.norm(), 0.08F);
            EXPECT_LT(shift.cross(pixel_point(room.frame, p).normalized()).norm(), 5e-3F);
            EXPECT_NEAR(normal(points, i).norm(), 1.0F, 1e-4F);
            EXPECT_LT(normal(points, i).dot(selected_point(points, i)), 0.0F);
            EXPECT_GT(points.planarity[i], 0.0F);
            EXPECT_LE(points.planarity[i], 1.0F);
        }
    }
}

TEST_P(Resolutions, EveryCandidateIsTakenOnceWhereNothingIsThinned) {
    const auto [height, width] = GetParam();
    SubsamplingConfig config = all_candidates();
    config.rows = 16;
    config.column_step = 8;
    config.min_range_m = 2.0;
    config.crop_box_m = 3.0;
    const PointSelection& points = room.select(config);
    std::set<PixelIndex> expected;
    for (int i = 0; i < 16; ++i) {
        const int row = (2 * i + 1) * height / 32;
        for (int c = 0; c < width; c += 8 * std::max(1, width / 1024)) {
            const auto p = static_cast<PixelIndex>(row * width + c);
            const Eigen::Vector3f q = pixel_point(room.frame, p);
            const bool inside = q.cwiseAbs().maxCoeff() < 3.0F;
            if (room.frame.cloud.range_m[p] >= 2.0F && !inside) expected.insert(p);
        }
    }
    EXPECT_EQ(std::set<PixelIndex>(points.pixel.begin(), points.pixel.end()), expected);
    EXPECT_EQ(points.size(), expected.size());
}

TEST_P(Resolutions, NothingOfTheRobotItselfIsTaken) {
    SubsamplingConfig config = all_candidates();
    config.min_range_m = 3.0;
    config.crop_box_m = 4.0;
    const PointSelection& points = room.select(config);
    ASSERT_GT(points.size(), 100U);
    for (std::size_t i = 0; i < points.size(); ++i) {
        EXPECT_GE(room.frame.cloud.range_m[points.pixel[i]], 3.0F);
        EXPECT_GE(pixel_point(room.frame, points.pixel[i]).cwiseAbs().maxCoeff(), 4.0F);
    }
}

TEST_P(Resolutions, FlatPointsComeFirstAndEachKindInTheOrderOfItsFiring) {
    const PointSelection& points = room.select(SubsamplingConfig{});
    std::size_t rough = 0;
    while (rough < points.size() && !normal(points, rough).isZero()) ++rough;
    EXPECT_GT(rough, 0U);
    // Of windows that are fired half between two columns either may come first.
    const float column_s = 0.1F / static_cast<float>(GetParam().second);
    for (std::size_t i = 1; i < rough; ++i) EXPECT_GT(points.time_s[i], points.time_s[i - 1] - 1.01F * column_s);
    EXPECT_TRUE(std::is_sorted(points.measurement.begin() + static_cast<long>(rough), points.measurement.end()));
    for (std::size_t i = rough; i < points.size(); ++i) EXPECT_TRUE(normal(points, i).isZero());
}

INSTANTIATE_TEST_SUITE_P(Subsampling, Resolutions,
                         testing::Values(std::pair{128, 1024}, std::pair{64, 512}, std::pair{32, 2048},
                                         std::pair{16, 1024}));

/// The paper's implementation thins with a voxel grid: no part of the scene may be missing that a grid would keep.
TEST(Subsampling, CoversWhatAVoxelGridKeepsAndIsAsEven) {
    Room room(resolution(128, 1024));
    SubsamplingConfig config;
    config.crop_box_m = 0.0;
    const PointSelection& points = room.select(config);
    std::vector<Eigen::Vector3f> all, selected;
    for (PixelIndex p = 0; p < room.frame.raw.range_mm.size(); ++p) {
        if (room.frame.cloud.range_m[p] >= 0.5F) all.push_back(pixel_point(room.frame, p));
    }
    for (std::size_t i = 0; i < points.size(); ++i) selected.push_back(selected_point(points, i));
    constexpr float kLeaf_m = 1.0F;
    const auto grid = pcl_voxel_grid(all, kLeaf_m, 20);
    ASSERT_GT(grid.size(), 300U);
    int missing = 0;
    for (const Eigen::Vector3f& centroid : grid) {
        const bool near = std::any_of(selected.begin(), selected.end(),
                                      [&](const Eigen::Vector3f& p) { return (p - centroid).norm() < kLeaf_m; });
        missing += near ? 0 : 1;
    }
    // Every fourth row is a candidate: what a grid keeps of the rows between them is small and far.
    EXPECT_LE(missing, static_cast<int>(grid.size() / 50));
    // The fullest cell of the raw cloud holds many times its share; of the selection clearly less.
    const auto largest_share = [&](const std::vector<Eigen::Vector3f>& cloud) {
        std::map<std::tuple<int, int, int>, int> cells;
        int most = 0;
        for (const Eigen::Vector3f& p : cloud) {
            const Eigen::Vector3i v = (p / kLeaf_m).array().floor().cast<int>();
            most = std::max(most, ++cells[{v.x(), v.y(), v.z()}]);
        }
        return static_cast<double>(most) / static_cast<double>(cloud.size());
    };
    EXPECT_LT(largest_share(selected), 0.6 * largest_share(all));
}

TEST(Subsampling, SelectedPointsLieOnTheSurfacesOfAVoxelGrid) {
    Room room(resolution(64, 1024));
    const PointSelection& points = room.select(SubsamplingConfig{});
    std::vector<Eigen::Vector3f> all;
    for (PixelIndex p = 0; p < room.frame.raw.range_mm.size(); ++p) {
        if (room.frame.cloud.range_m[p] > 0.0F) all.push_back(pixel_point(room.frame, p));
    }
    const auto grid = pcl_voxel_grid(all, 0.5F, 1);
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Eigen::Vector3f p = selected_point(points, i);
        EXPECT_TRUE(std::any_of(grid.begin(), grid.end(),
                                [&](const Eigen::Vector3f& centroid) { return (p - centroid).norm() < 0.5F; }));
    }
}

// A long corridor: its few points on the end wall are all that says how far along the robot is.
TEST(Subsampling, FewPointsOfARareDirectionAreAllKept) {
    const std::vector<SceneBox> corridor = {{{-30, -1.5, -1}, {12, 1.5, 1.5}, true}};
    const auto facing_x = [](const PointSelection& points) {
        std::set<PixelIndex> pixels;
        for (std::size_t i = 0; i < points.size(); ++i) {
            if (std::abs(points.nx[i]) > 0.95F) pixels.insert(points.pixel[i]);
        }
        return pixels;
    };
    SubsamplingConfig config;
    config.points = 50000;
    Room unlimited(resolution(64, 1024), corridor);
    const auto all = facing_x(unlimited.select(config));
    ASSERT_GT(all.size(), 5U);
    const std::size_t without_budget = unlimited.frame.prepared.points.size();
    config.points = 600;
    config.least_points = 0;
    Room limited(resolution(64, 1024), corridor);
    const PointSelection& points = limited.select(config);
    EXPECT_EQ(facing_x(points), all);
    std::size_t flat = 0;
    for (std::size_t i = 0; i < points.size(); ++i) flat += points.nx[i] != 0.0F || points.nz[i] != 0.0F;
    EXPECT_LE(flat, 600U);
    EXPECT_GT(flat, 500U);
    EXPECT_LT(flat, without_budget / 2);
}

TEST(Subsampling, OfWhatIsNotFlatNoMoreIsTakenThanToldFromAllAround) {
    Room room(resolution(64, 1024));
    SubsamplingConfig config = all_candidates();
    config.rows = 64;
    config.column_step = 1;
    // By sixteenths of the turn.
    const auto rough = [&] {
        std::array<int, 16> count{};
        const PointSelection& points = room.select(config);
        for (std::size_t i = 0; i < points.size(); ++i) {
            if (normal(points, i).isZero()) ++count[points.pixel[i] % 1024 / 64];
        }
        return count;
    };
    const auto sum = [](const std::array<int, 16>& count) { return std::accumulate(count.begin(), count.end(), 0); };
    const auto all = rough();
    ASSERT_GT(sum(all), 4000);
    config.rough_points = sum(all) / 5;
    const auto few = rough();
    EXPECT_EQ(sum(few), config.rough_points);
    for (std::size_t k = 0; k < few.size(); ++k) EXPECT_NEAR(few[k], all[k] / 5, 5 + all[k] / 50) << k;
}

TEST(Subsampling, NearSurfacesAreThinnedToTheSpacing) {
    // All around at 1.5 m: 9.2 mm from column to column.
    Room room(resolution(64, 1024), {{{-1.2, -1.7, -0.9}, {1.8, 1.3, 1.1}, true}});
    SubsamplingConfig config;
    config.points = 50000;
    config.least_points = 0;
    config.spacing_m = 0.12;
    config.rows = 1;
    config.column_step = 2;
    config.crop_box_m = 0.0;
    const PointSelection& points = room.select(config);
    std::vector<PixelIndex> flat;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!normal(points, i).isZero()) flat.push_back(points.pixel[i]);
    }
    ASSERT_GT(flat.size(), 30U);
    std::sort(flat.begin(), flat.end());
    double sum = 0.0;
    for (std::size_t i = 1; i < flat.size(); ++i) {
        const double range_m = static_cast<double>(room.frame.cloud.range_m[flat[i]]);
        const double arc_m = (flat[i] - flat[i - 1]) * range_m * 2.0 * std::numbers::pi / 1024.0;
        EXPECT_GT(arc_m, 0.05);
        sum += std::min(arc_m, 0.3);
    }
    EXPECT_LT(sum / static_cast<double>(flat.size()), 0.13);
}

TEST(Subsampling, RawPointsTakePartOnlyWhereFlatOnesAreFew) {
    Room room(resolution(64, 1024));
    SubsamplingConfig config;
    config.least_points = 0;
    const auto taking_part = [&] {
        int raw = 0;
        const PointSelection& points = room.select(config);
        for (std::size_t i = 0; i < points.size(); ++i) {
            raw += normal(points, i).isZero() && points.planarity[i] > 0.0F ? 1 : 0;
        }
        return raw;
    };
    EXPECT_EQ(taking_part(), 0);
    std::size_t flat = 0;
    for (std::size_t i = 0; i < room.frame.prepared.points.size(); ++i) {
        flat += normal(room.frame.prepared.points, i).isZero() ? 0 : 1;
    }
    config.least_points = static_cast<int>(flat) + 100;
    EXPECT_EQ(taking_part(), 100);
}

TEST(Subsampling, WherePacketsAreLostOtherRowsAndPartsOfWindowsMakeUpForThem) {
    Room whole(resolution(128, 1024));
    const PointSelection& all = whole.select(SubsamplingConfig{});
    Room torn(resolution(128, 1024));
    torn.drive.column_arrives = [](int, int m) { return (m / 16 * 7) % 10 < 4; };
    torn.drive.fill(1, torn.frame);
    ASSERT_LT(torn.frame.header.valid_columns, 450);
    const PointSelection& rest = torn.select(SubsamplingConfig{});
    // By the axis of the normal, and its sign.
    const auto flat = [](const PointSelection& points) {
        std::array<int, 6> count{};
        for (std::size_t i = 0; i < points.size(); ++i) {
            if (normal(points, i).isZero()) continue;
            Eigen::Index axis;
            normal(points, i).cwiseAbs().maxCoeff(&axis);
            ++count[static_cast<std::size_t>(2 * axis + (normal(points, i)[axis] > 0.0F ? 1 : 0))];
        }
        return count;
    };
    const auto before = flat(all), after = flat(rest);
    for (std::size_t side = 0; side < 6; ++side) EXPECT_GT(after[side], before[side] / 4) << side;
    EXPECT_LE(rest.size(), 32U * 256U);
    for (std::size_t i = 0; i < rest.size(); ++i) {
        ASSERT_TRUE(torn.frame.columns.valid[rest.measurement[i]]);
        ASSERT_TRUE(std::isfinite(rest.x[i] + rest.nx[i] + rest.planarity[i] + rest.time_s[i] + rest.tx[i]));
    }
}

TEST(Subsampling, AFrameWithoutReturnsGivesNoPoints) {
    DriveOptions options = resolution(32, 512);
    Room room(options, {});
    EXPECT_EQ(room.select(SubsamplingConfig{}).size(), 0U);
}

TEST(Subsampling, NothingOfTheFrameBeforeRemains) {
    Room room(resolution(32, 512));
    Subsampling subsampling(room.drive.sensor(), SubsamplingConfig{});
    subsampling.process(room.frame);
    const PointSelection first = room.frame.prepared.points;
    Room empty(resolution(32, 512), {});
    subsampling.process(empty.frame);
    EXPECT_EQ(empty.frame.prepared.points.size(), 0U);
    subsampling.process(room.frame);
    EXPECT_EQ(room.frame.prepared.points.pixel, first.pixel);
    EXPECT_EQ(room.frame.prepared.points.x, first.x);
    EXPECT_EQ(room.frame.prepared.points.nz, first.nz);
}

}  // namespace
}  // namespace dlod::test
