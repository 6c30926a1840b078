#include "core/registration/scan_to_submap.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "core/map/keyframe_cloud.hpp"
#include "core/map/keyframe_database.hpp"
#include "tests/core/registration/scans.hpp"
#include "tests/support/pcl_reference.hpp"

namespace dlod::test {
namespace {

/// A submap of scans at their true poses.
struct Submap {
    explicit Submap(std::span<const Scan> scans) : database(KeyframeConfig{}, VoxelMapConfig{}) {
        for (const Scan& scan : scans) {
            PlacedPoints placed;
            place(scan.points, at_rest(scan.T_world_sensor), placed);
            KeyframeCloud cloud;
            build_keyframe_cloud(placed, Eigen::Vector3d::Zero(), cloud);
            database.add(cloud);
        }
        database.update_submap(scans.front().T_world_sensor.translation());
    }
    VoxelMap& voxels() { return database.submap(); }
    KeyframeDatabase database;
};

/// The pose of a scan in the world, which is the local frame with its origin in voxel 0.
Eigen::Isometry3d align(const ScanToSubmap& registration, VoxelMap& voxels, const Scan& scan,
                        const Eigen::Isometry3d& guess, int iterations) {
    return register_scan(scan, guess, iterations, [&](int i, const PlacedPoints& placed, PlaneMatches& matches) {
        registration.match(scan.points, scan.excluded, placed, voxels, {}, i < 3 ? 3.0 : 1.0, matches);
    });
}

class ScanToSubmapMotions : public testing::TestWithParam<Motion> {};

TEST_P(ScanToSubmapMotions, AreRecoveredFromNoGuessAsWellAsByPcl) {
    const Motion& motion = GetParam();
    const Scan target = take_scan(motion.scene(), first_pose(), 1);
    const Eigen::Isometry3d truth = first_pose() * motion.pose();
    const Scan scan = take_scan(motion.scene(), truth, 2);
    Submap submap({&target, 1});
    const ScanToSubmap registration{ScanToSubmapConfig{}};
    const PoseError error = error_of(align(registration, submap.voxels(), scan, first_pose(), 15), truth);
    const PclAlignment pcl = pcl_gicp(scan.positions(), target.positions(), Eigen::Isometry3d::Identity());
    ASSERT_TRUE(pcl.converged);
    const PoseError pcl_error = error_of(pcl.T_target_source, motion.pose());
    RecordProperty("error_mm", std::to_string(1e3 * error.translation_m));
    RecordProperty("pcl_error_mm", std::to_string(1e3 * pcl_error.translation_m));
    EXPECT_LT(error.translation_m, 0.002);
    EXPECT_LT(error.rotation_deg, 0.02);
    EXPECT_LE(error.translation_m, pcl_error.translation_m + 0.001);
    EXPECT_LE(error.rotation_deg, pcl_error.rotation_deg + 0.015);
}

INSTANTIATE_TEST_SUITE_P(Registration, ScanToSubmapMotions, testing::ValuesIn(kMotions),
                         [](const auto& test) { return test.param.name; });

class ScanToSubmapTest : public testing::Test {
  protected:
    ScanToSubmapTest()
        : target(take_scan(furnished_room(), first_pose(), 1)),
          scan(take_scan(furnished_room(), first_pose(), 2)),
          submap({&target, 1}) {}

    PlaneMatches match(const Scan& moving, double widening = 1.0) {
        PlacedPoints placed;
        PlaneMatches matches;
        place(moving.points, at_rest(moving.T_world_sensor), placed);
        registration.match(moving.points, moving.excluded, placed, submap.voxels(), {}, widening, matches);
        return matches;
    }

    Scan target, scan;
    Submap submap;
    ScanToSubmapConfig config;
    ScanToSubmap registration{config};
};

TEST_F(ScanToSubmapTest, MoreScansGiveABetterPose) {
    std::vector<Scan> scans;
    for (std::uint64_t i = 0; i < 6; ++i) {
        const Motion step{"", true, {0.1 * static_cast<double>(i), 0.0, 0.0}, {0, 0, 0.05 * static_cast<double>(i)}};
        scans.push_back(take_scan(furnished_room(), first_pose() * step.pose(), 10 + i));
    }
    Submap several(scans);
    const PoseError error = error_of(align(registration, several.voxels(), scan, first_pose(), 10), first_pose());
    EXPECT_LT(error.translation_m, 0.001);
    EXPECT_LT(error.rotation_deg, 0.01);
}

TEST_F(ScanToSubmapTest, TheOriginOfTheLocalFrameIsFree) {
    const VoxelIndex origin{3, -7, 2};
    const double side = submap.voxels().voxel_m();
    const Eigen::Vector3d origin_m = side * Eigen::Vector3d(origin.x, origin.y, origin.z);
    Eigen::Isometry3d T_local_sensor = first_pose();
    T_local_sensor.translation() -= origin_m;
    PlacedPoints placed;
    PlaneMatches moved;
    place(scan.points, at_rest(T_local_sensor), placed);
    registration.match(scan.points, scan.excluded, placed, submap.voxels(), origin, 1.0, moved);
    const PlaneMatches direct = match(scan);
    // Points within rounding of a voxel's side may fall into the other voxel.
    EXPECT_NEAR(static_cast<double>(moved.count), static_cast<double>(direct.count), 5.0);
    double sum = 0.0, direct_sum = 0.0;
    for (std::size_t i = 0; i < moved.count; ++i) sum += std::abs(static_cast<double>(moved.residual[i]));
    for (std::size_t i = 0; i < direct.count; ++i) direct_sum += std::abs(static_cast<double>(direct.residual[i]));
    EXPECT_NEAR(sum, direct_sum, 0.01 * direct_sum);
}

TEST_F(ScanToSubmapTest, ExcludedPointsHaveNoPart) {
    const std::size_t all = match(scan).count;
    EXPECT_GT(all, scan.points.size() / 10);
    for (std::size_t i = 0; i < scan.points.size(); ++i) scan.excluded[i] = i % 2;
    const std::size_t half = match(scan).count;
    EXPECT_GT(half, 2 * all / 5);
    EXPECT_LT(half, 3 * all / 5);
    scan.excluded.assign(scan.points.size(), 1);
    EXPECT_EQ(match(scan).count, 0U);
}

TEST_F(ScanToSubmapTest, TheGateOpensWithTheWidening) {
    scan.T_world_sensor.translation() += Eigen::Vector3d(0.2, 0.1, 0.05);
    const auto farthest = [](const PlaneMatches& m) {
        float most = 0.0F;
        for (std::size_t i = 0; i < m.count; ++i) most = std::max(most, std::abs(m.residual[i]));
        return most;
    };
    config.gate_m = 0.1;
    registration = ScanToSubmap(config);
    const PlaneMatches narrow = match(scan), wide = match(scan, 2.0);
    EXPECT_LE(farthest(narrow), 0.1F);
    EXPECT_GT(farthest(wide), 0.1F);
    EXPECT_LE(farthest(wide), 0.2F);
    EXPECT_GT(wide.count, narrow.count);
}

/// Distance to a voxel's Gaussian as documented, slowly.
double slow_distance(const VoxelPlane& plane, const Eigen::Vector3d& from_center) {
    const auto vector = [](const float v[3]) { return Eigen::Vector3d(v[0], v[1], v[2]); };
    const Eigen::Vector3d d = from_center - vector(plane.mean);
    const Eigen::Vector3d n = vector(plane.normal), t = vector(plane.tangent);
    const auto beyond = [](double distance, double slack) { return std::max(0.0, std::abs(distance) - slack); };
    return Eigen::Vector3d(beyond(d.dot(n), plane.flat ? 0.0 : 2.0 * static_cast<double>(plane.thickness_m)),
                           beyond(d.dot(t), 2.0 * static_cast<double>(plane.extent_m[0])),
                           beyond(d.dot(n.cross(t)), 2.0 * static_cast<double>(plane.extent_m[1])))
        .norm();
}

TEST_F(ScanToSubmapTest, ResidualsAreTheDistancesThatASearchOfAllNeighboursGives) {
    // Somewhere else: many points lie in empty voxels.
    scan.T_world_sensor.translation() += Eigen::Vector3d(0.9, -0.6, 0.4);
    PlacedPoints placed;
    place(scan.points, at_rest(scan.T_world_sensor), placed);
    AlignedVector<PixelIndex> pixel;
    AlignedVector<float> residual;
    registration.residuals(scan.points, placed, submap.voxels(), {}, pixel, residual);
    ASSERT_EQ(residual.size(), scan.points.size());
    EXPECT_TRUE(std::equal(pixel.begin(), pixel.end(), scan.points.pixel.begin(), scan.points.pixel.end()));
    const double side = submap.voxels().voxel_m();
    int compared = 0, empty = 0, capped = 0;
    for (std::size_t i = 0; i < residual.size(); ++i) {
        const Eigen::Vector3d q = Eigen::Vector3f(placed.x[i], placed.y[i], placed.z[i]).cast<double>();
        const Eigen::Vector3d cell = (q / side).array().floor();
        if (((q / side - cell).array() < 1e-3).any() || ((q / side - cell).array() > 0.999).any()) continue;
        const Eigen::Vector3i c = cell.cast<int>();
        const auto center = [&](int x, int y, int z) {
            return Eigen::Vector3d(side * (Eigen::Vector3d(x, y, z).array() + 0.5));
        };
        // A Gaussian reaches beyond its voxel: neighbours that are farther than the best so far are not asked.
        double expected = config.residual_cap_m, upper = config.residual_cap_m;
        if (const VoxelPlane* own = submap.voxels().find({c.x(), c.y(), c.z()})) {
            upper = expected = std::min(expected, slow_distance(*own, q - center(c.x(), c.y(), c.z())));
        } else {
            ++empty;
            for (int k = 0; k < 27; ++k) {
                const Eigen::Vector3i n = c + Eigen::Vector3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
                const VoxelPlane* plane = submap.voxels().find({n.x(), n.y(), n.z()});
                if (plane == nullptr) continue;
                const double distance = slow_distance(*plane, q - center(n.x(), n.y(), n.z()));
                const Eigen::Vector3d outside =
                    ((q - center(n.x(), n.y(), n.z())).cwiseAbs().array() - 0.5 * side).max(0.0);
                expected = std::min(expected, distance);
                upper = std::min(upper, std::max(distance, outside.norm()));
            }
        }
        EXPECT_GT(static_cast<double>(residual[i]), expected - 1e-3) << i;
        EXPECT_LT(static_cast<double>(residual[i]), upper + 1e-3) << i;
        capped += expected >= config.residual_cap_m;
        ++compared;
    }
    EXPECT_GT(compared, 1000);
    EXPECT_GT(empty, 300);
    EXPECT_GT(capped, 10);
}

TEST_F(ScanToSubmapTest, ResidualsTellWhatWasNotThereBefore) {
    std::vector<SceneBox> scene = furnished_room();
    scene.push_back({{2.0, -1.5, -1.0}, {2.5, -1.0, 0.8}});
    const Scan with_person = take_scan(scene, first_pose(), 5);
    PlacedPoints placed;
    place(with_person.points, at_rest(first_pose()), placed);
    AlignedVector<PixelIndex> pixel;
    AlignedVector<float> residual;
    registration.residuals(with_person.points, placed, submap.voxels(), {}, pixel, residual);
    std::vector<float> on, off;
    for (std::size_t i = 0; i < residual.size(); ++i) {
        const bool person = std::abs(placed.x[i] - 2.25F) < 0.3F && std::abs(placed.y[i] + 1.25F) < 0.3F &&
                            std::abs(placed.z[i] + 0.1F) < 0.7F;
        (person ? on : off).push_back(residual[i]);
    }
    ASSERT_GT(on.size(), 20U);
    const auto median = [](std::vector<float>& values) {
        std::nth_element(values.begin(), values.begin() + static_cast<long>(values.size() / 2), values.end());
        return values[values.size() / 2];
    };
    EXPECT_GT(median(on), 0.3F);
    EXPECT_LT(median(off), 0.02F);
}

TEST_F(ScanToSubmapTest, AnEmptySubmapGivesNoMatchAndResidualsAtTheCap) {
    KeyframeDatabase nothing(KeyframeConfig{}, VoxelMapConfig{});
    PlacedPoints placed;
    PlaneMatches matches;
    place(scan.points, at_rest(first_pose()), placed);
    registration.match(scan.points, scan.excluded, placed, nothing.submap(), {}, 1.0, matches);
    EXPECT_EQ(matches.count, 0U);
    AlignedVector<PixelIndex> pixel;
    AlignedVector<float> residual;
    registration.residuals(scan.points, placed, nothing.submap(), {}, pixel, residual);
    for (const float r : residual) EXPECT_FLOAT_EQ(r, static_cast<float>(config.residual_cap_m));
}

}  // namespace
}  // namespace dlod::test
