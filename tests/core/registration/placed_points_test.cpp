#include "core/registration/placed_points.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/preprocess/subsampling.hpp"
#include "tests/core/registration/sweeps.hpp"
#include "tests/support/simulated_drive.hpp"

namespace dlod::test {
namespace {

PointSelection random_points(std::size_t count, double duration_s, bool in_order) {
    std::mt19937_64 random(4);
    std::normal_distribution<float> gauss;
    std::uniform_real_distribution<float> time(static_cast<float>(-duration_s), 0.0F);
    PointSelection points;
    std::vector<float> times(count);
    for (float& t : times) t = time(random);
    if (in_order) std::sort(times.begin(), times.end());
    for (std::size_t i = 0; i < count; ++i) {
        const Eigen::Vector3f n = Eigen::Vector3f(gauss(random), gauss(random), gauss(random)).normalized();
        points.pixel.push_back(static_cast<PixelIndex>(i));
        points.measurement.push_back(0);
        points.x.push_back(15.0F * gauss(random));
        points.y.push_back(15.0F * gauss(random));
        points.z.push_back(3.0F * gauss(random));
        points.nx.push_back(n.x());
        points.ny.push_back(n.y());
        points.nz.push_back(n.z());
        points.planarity.push_back(1.0F);
        points.time_s.push_back(times[i]);
        for (auto* gradient : {&points.tx, &points.ty, &points.tz}) gradient->push_back(0.0F);
    }
    return points;
}

/// Largest distance between the points as placed and as they are placed one by one, in double precision.
template <class PoseAt>
double largest_error(const PointSelection& points, const PlacedPoints& placed, PoseAt&& pose_at) {
    double largest = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Eigen::Isometry3d T = pose_at(static_cast<double>(points.time_s[i]));
        const Eigen::Vector3d p = Eigen::Vector3f(points.x[i], points.y[i], points.z[i]).cast<double>();
        const Eigen::Vector3d n = Eigen::Vector3f(points.nx[i], points.ny[i], points.nz[i]).cast<double>();
        const auto error = [&](const auto& x, const auto& y, const auto& z, const Eigen::Vector3d& expected) {
            largest = std::max(largest, (Eigen::Vector3f(x[i], y[i], z[i]).cast<double>() - expected).norm());
        };
        error(placed.x, placed.y, placed.z, T * p);
        error(placed.lx, placed.ly, placed.lz, T.linear() * p);
        error(placed.nx, placed.ny, placed.nz, T.linear() * n);
    }
    return largest;
}

TEST(PlacedPoints, AreThoseOfAPlainLoop) {
    const SweepMotion motion = sweep_of(fast_and_turning, 0.1);
    for (const bool in_order : {true, false}) {
        const PointSelection points = random_points(4099, 0.1, in_order);
        PlacedPoints placed;
        place(points, motion, placed);
        ASSERT_EQ(placed.size(), points.size());
        EXPECT_LT(largest_error(points, placed, [&](double t) { return interpolated(motion, t); }), 3e-5);
    }
}

TEST(PlacedPoints, FollowTheTrueMotionAtFiveRadiansASecond) {
    const SweepMotion motion = sweep_of(fast_and_turning, 0.1);
    const PointSelection points = random_points(2000, 0.1, true);
    PlacedPoints placed;
    place(points, motion, placed);
    // At up to 50 m: some 1e-5 rad.
    EXPECT_LT(largest_error(points, placed, fast_and_turning), 1.5e-3);
}

TEST(PlacedPoints, BeforeTheFirstKnotAndAfterTheLastTheirPosesHold) {
    const SweepMotion motion = sweep_of(fast_and_turning, 0.1);
    PointSelection points = random_points(64, 0.1, true);
    for (std::size_t i = 0; i < points.size(); ++i) points.time_s[i] = i % 2 == 0 ? -0.15F : 0.01F;
    PlacedPoints placed;
    place(points, motion, placed);
    EXPECT_LT(largest_error(points, placed, [&](double t) { return interpolated(motion, std::clamp(t, -0.1, 0.0)); }),
              3e-5);
}

/// Distance from a face of one of the boxes, and its normal.
struct Face {
    double distance_m = 1e9;
    Eigen::Vector3d normal;
};

Face nearest_face(const std::vector<SceneBox>& scene, const Eigen::Vector3d& p) {
    Face nearest;
    for (const SceneBox& box : scene) {
        for (int axis = 0; axis < 3; ++axis) {
            for (const double side : {box.low[axis], box.high[axis]}) {
                const double distance = std::abs(p[axis] - side);
                if (distance >= nearest.distance_m) continue;
                const Eigen::Vector3d outside = (box.low - p).cwiseMax(p - box.high);
                if (outside.maxCoeff() < 0.05) nearest = {distance, Eigen::Vector3d::Unit(axis)};
            }
        }
    }
    return nearest;
}

// The rows of a window are fired milliseconds apart, from origins that lie up to a centimetre apart: neither the place
// nor the normal that they give may depend on that.
TEST(PlacedPoints, LieOnTheirSurfacesThoughTheSensorMovesWhileAWindowIsFired) {
    const std::vector<SceneBox> scene = furnished_room();
    const Eigen::Vector3d v_mps(5.0, 1.5, 0.5);
    const auto trajectory = [&](double t) {
        return make_pose(so3_exp(Eigen::Vector3d(0.02, -0.03, 0.4 + 0.8 * t)),
                         Eigen::Vector3d(-3, -1, 0.2) + t * v_mps);
    };
    DriveOptions options;
    options.height = 128;
    options.width = 1024;
    options.range_noise_m = 0.0;
    SimulatedDrive drive(scene, trajectory, options);
    Frame frame(drive.sensor());
    drive.fill(0, frame);
    Subsampling(drive.sensor(), SubsamplingConfig{}).process(frame);
    const double stamp_s = drive.last_stamp_s();
    PlacedPoints placed;
    place(frame.prepared.points, sweep_of([&](double t) { return trajectory(stamp_s + t); }, 0.1), placed);
    std::vector<double> distance_m, angle_rad;
    for (std::size_t i = 0; i < placed.size(); ++i) {
        const Eigen::Vector3d n = Eigen::Vector3f(placed.nx[i], placed.ny[i], placed.nz[i]).cast<double>();
        // Windows across an edge are of no plane.
        if (n.norm() < 0.5 || n.cwiseAbs().maxCoeff() < 0.98) continue;
        const Face face = nearest_face(scene, Eigen::Vector3f(placed.x[i], placed.y[i], placed.z[i]).cast<double>());
        EXPECT_NEAR(n.norm(), 1.0, 0.01);
        distance_m.push_back(face.distance_m);
        angle_rad.push_back(n.cross(face.normal).norm());
    }
    ASSERT_GT(distance_m.size(), 1000U);
    const auto quantile = [](std::vector<double> values, double share) {
        std::sort(values.begin(), values.end());
        return values[static_cast<std::size_t>(share * static_cast<double>(values.size()))];
    };
    EXPECT_LT(quantile(distance_m, 0.5), 0.5e-3);
    EXPECT_LT(quantile(distance_m, 0.9), 2e-3);
    // Ranges come in millimetres.
    EXPECT_LT(quantile(angle_rad, 0.5), 8e-3);
    EXPECT_LT(quantile(angle_rad, 0.9), 0.03);
}

TEST(PlacedPoints, NoneAreNone) {
    PlacedPoints placed;
    place(random_points(10, 0.1, true), sweep_of(fast_and_turning, 0.1), placed);
    place(PointSelection{}, sweep_of(fast_and_turning, 0.1), placed);
    EXPECT_EQ(placed.size(), 0U);
}

TEST(SweepMotion, GivesTheKnotsAndTheirMeans) {
    const SweepMotion motion = sweep_of(fast_and_turning, 0.08);
    EXPECT_FLOAT_EQ(motion.time_of(0), -0.08F);
    EXPECT_NEAR(motion.time_of(SweepMotion::kKnots - 1), 0.0F, 1e-7F);
    for (int k = 0; k + 1 < SweepMotion::kKnots; ++k) {
        float at[12];
        motion.at(motion.time_of(k), at);
        for (int i = 0; i < 12; ++i) EXPECT_NEAR(at[i], motion.rows[k][i], 1e-5F);
        motion.at(motion.time_of(k) + 0.5F * motion.step_s(), at);
        for (int i = 0; i < 12; ++i) EXPECT_NEAR(at[i], 0.5F * (motion.rows[k][i] + motion.rows[k + 1][i]), 1e-5F);
    }
    float first[12], last[12];
    motion.at(-10.0F, first);
    motion.at(1.0F, last);
    for (int i = 0; i < 12; ++i) {
        EXPECT_FLOAT_EQ(first[i], motion.rows[0][i]);
        EXPECT_FLOAT_EQ(last[i], motion.rows[SweepMotion::kKnots - 1][i]);
    }
}

}  // namespace
}  // namespace dlod::test
