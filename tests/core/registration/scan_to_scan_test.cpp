#include "core/registration/scan_to_scan.hpp"

#include <gtest/gtest.h>

#include "tests/core/registration/scans.hpp"
#include "tests/support/pcl_reference.hpp"

namespace dlod::test {
namespace {

/// Makes a scan the target, its own sensor frame being the local one.
void set_target(ScanToScan& registration, const Scan& scan) {
    PlacedPoints placed;
    place(scan.points, at_rest(Eigen::Isometry3d::Identity()), placed);
    registration.set_target(scan.points, {}, placed, Eigen::Isometry3f::Identity());
}

Eigen::Isometry3d align(const ScanToScan& registration, const Scan& scan, const Eigen::Isometry3d& guess,
                        int iterations) {
    return register_scan(scan, guess, iterations, [&](int, const PlacedPoints& placed, PlaneMatches& matches) {
        registration.match(scan.points, scan.excluded, placed, Eigen::Isometry3f::Identity(), 1.0, matches);
    });
}

class ScanToScanMotions : public testing::TestWithParam<Motion> {};

TEST_P(ScanToScanMotions, AreRecoveredFromNoGuessAsWellAsByPcl) {
    const Motion& motion = GetParam();
    const Scan target = take_scan(motion.scene(), first_pose(), 1);
    const Scan scan = take_scan(motion.scene(), first_pose() * motion.pose(), 2);
    ScanToScan registration{ScanToScanConfig{}};
    set_target(registration, target);
    const PoseError error = error_of(align(registration, scan, Eigen::Isometry3d::Identity(), 15), motion.pose());
    const PclAlignment pcl = pcl_gicp(scan.positions(), target.positions(), Eigen::Isometry3d::Identity());
    ASSERT_TRUE(pcl.converged);
    const PoseError pcl_error = error_of(pcl.T_target_source, motion.pose());
    RecordProperty("error_mm", std::to_string(1e3 * error.translation_m));
    RecordProperty("pcl_error_mm", std::to_string(1e3 * pcl_error.translation_m));
    // It gives the second stage its guess: centimetres serve, and it gives millimetres.
    EXPECT_LT(error.translation_m, 0.01);
    EXPECT_LT(error.rotation_deg, 0.1);
    EXPECT_LE(error.translation_m, pcl_error.translation_m + 0.003);
    EXPECT_LE(error.rotation_deg, pcl_error.rotation_deg + 0.03);
}

INSTANTIATE_TEST_SUITE_P(Registration, ScanToScanMotions, testing::ValuesIn(kMotions),
                         [](const auto& test) { return test.param.name; });

class ScanToScanTest : public testing::Test {
  protected:
    ScanToScanTest()
        : target(take_scan(furnished_room(), first_pose(), 1)), scan(take_scan(furnished_room(), first_pose(), 2)) {}

    PlaneMatches match(const Scan& moving, double widening = 1.0) {
        PlacedPoints placed;
        PlaneMatches matches;
        place(moving.points, at_rest(Eigen::Isometry3d::Identity()), placed);
        registration.match(moving.points, moving.excluded, placed, Eigen::Isometry3f::Identity(), widening, matches);
        return matches;
    }

    Scan target, scan;
    ScanToScan registration{ScanToScanConfig{}};
};

TEST_F(ScanToScanTest, RawPointsThatMakeUpForFlatOnesTakeNoneOfTheirPlaces) {
    set_target(registration, target);
    const std::size_t matched = match(scan).count;
    ASSERT_GT(matched, 100U);
    // All those without a normal, which come last, take part now.
    std::size_t raw = 0;
    for (std::size_t i = 0; i < scan.points.size(); ++i) {
        if (scan.points.nx[i] != 0.0F || scan.points.ny[i] != 0.0F || scan.points.nz[i] != 0.0F) continue;
        scan.points.planarity[i] = 0.1F;
        ++raw;
    }
    ASSERT_GT(raw, matched);
    EXPECT_EQ(match(scan).count, matched);
}

TEST_F(ScanToScanTest, HasNoTargetBeforeTheFirstScanAndAfterItIsCleared) {
    EXPECT_FALSE(registration.has_target());
    set_target(registration, target);
    EXPECT_TRUE(registration.has_target());
    registration.clear_target();
    EXPECT_FALSE(registration.has_target());
}

TEST_F(ScanToScanTest, TheTargetsFrameMayBeAnyOther) {
    // The local frame of the target's scan is not its sensor frame, nor that of the present one.
    const Eigen::Isometry3d T_local_target = make_pose(so3_exp(Eigen::Vector3d(0.1, 0.2, -0.8)), {3.0, -2.0, 1.0});
    PlacedPoints placed;
    place(target.points, at_rest(T_local_target), placed);
    registration.set_target(target.points, {}, placed, T_local_target.inverse().cast<float>());
    const Eigen::Isometry3d T_other_target = make_pose(so3_exp(Eigen::Vector3d(0.0, 0.1, 1.1)), {-1.0, 0.5, 0.2});
    const Eigen::Isometry3f T_target_other = T_other_target.inverse().cast<float>();
    const Eigen::Isometry3d T_other_sensor =
        register_scan(scan, T_other_target, 5, [&](int, const PlacedPoints& points, PlaneMatches& matches) {
            registration.match(scan.points, scan.excluded, points, T_target_other, 1.0, matches);
        });
    const PoseError error = error_of(T_other_sensor, T_other_target);
    EXPECT_LT(error.translation_m, 0.005);
    EXPECT_LT(error.rotation_deg, 0.05);
}

TEST_F(ScanToScanTest, ExcludedPointsHaveNoPart) {
    std::vector<std::uint8_t> all(target.points.size(), 1);
    PlacedPoints placed;
    place(target.points, at_rest(Eigen::Isometry3d::Identity()), placed);
    registration.set_target(target.points, all, placed, Eigen::Isometry3f::Identity());
    EXPECT_EQ(match(scan).count, 0U);
    set_target(registration, target);
    const std::size_t matched = match(scan).count;
    EXPECT_GT(matched, 200U);
    for (std::size_t i = 0; i < scan.points.size(); ++i) scan.excluded[i] = scan.points.y[i] > 0.0F;
    const PlaneMatches half = match(scan);
    EXPECT_GT(half.count, 0U);
    EXPECT_LT(half.count, matched);
    scan.excluded.assign(scan.points.size(), 1);
    EXPECT_EQ(match(scan).count, 0U);
}

TEST_F(ScanToScanTest, FarCounterpartsAndOtherNormalsAreNotBelieved) {
    set_target(registration, target);
    const PlaneMatches matches = match(scan);
    for (std::size_t i = 0; i < matches.count; ++i) EXPECT_LE(std::abs(matches.residual[i]), 1.0F);
    // The same points with their normals turned away.
    Scan turned = scan;
    for (std::size_t i = 0; i < turned.points.size(); ++i) {
        turned.points.nx[i] *= -1.0F;
        turned.points.ny[i] *= -1.0F;
        turned.points.nz[i] *= -1.0F;
    }
    EXPECT_EQ(match(turned).count, 0U);
}

}  // namespace
}  // namespace dlod::test
