// The covariance that goes with a pose against the errors that the poses have, over many seeds of the simulator.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "tests/support/odometry_run.hpp"

namespace dlod::test {
namespace {

constexpr int kSeeds = 10;
constexpr int kFrames = 26;
constexpr int kFirst = 10;

/// A walk, another one with each seed.
Trajectory walk(std::uint64_t seed) {
    const auto s = static_cast<double>(seed);
    return [=](double t) {
        const double u = std::max(0.0, t - 0.5);
        const double way = u < 1.0 ? 0.5 * u * u : u - 0.5;
        Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
        T.translation() = Eigen::Vector3d(way * std::cos(0.5 * s) - 2.0, way * std::sin(0.5 * s) - 1.0,
                                          0.02 * std::min(u, 1.0) * std::sin(9.0 * u + s));
        T.linear() = (Eigen::AngleAxisd(0.4 * std::sin(0.7 * u + s) + s, Eigen::Vector3d::UnitZ()) *
                      Eigen::AngleAxisd(0.02 * std::sin(5.0 * u), Eigen::Vector3d::UnitX()))
                         .toRotationMatrix();
        return T;
    };
}

struct Consistency {
    double position = 0.0;  ///< mean normalised estimation error squared, per degree of freedom
    double rotation = 0.0;
};

Consistency measure(bool imu) {
    Consistency mean;
    int count = 0;
    for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
        DriveOptions options;
        options.width = 256;
        options.seed = seed;
        SimulatedDrive drive(furnished_room(), walk(seed), options);
        OdometryConfig config;
        config.use_imu = imu;
        OdometryRun run(drive, config);
        run.run(0, kFrames);
        for (int i = kFirst; i < kFrames; ++i) {
            const RunFrame& first = run.frames[0];
            const RunFrame& f = run.frames[static_cast<std::size_t>(i)];
            // Truth in the estimate's world.
            const Eigen::Isometry3d truth = first.estimate * first.truth.inverse() * f.truth;
            const Eigen::Vector3d p = f.estimate.translation() - truth.translation();
            const Eigen::Vector3d r = so3_log(Eigen::Quaterniond(f.estimate.rotation() * truth.rotation().transpose()));
            mean.position += p.dot(f.covariance.topLeftCorner<3, 3>().ldlt().solve(p)) / 3.0;
            mean.rotation += r.dot(f.covariance.bottomRightCorner<3, 3>().ldlt().solve(r)) / 3.0;
            ++count;
        }
    }
    mean.position /= count;
    mean.rotation /= count;
    return mean;
}

class Uncertainty : public testing::TestWithParam<bool> {};

TEST_P(Uncertainty, IsAsLargeAsTheErrors) {
    const Consistency c = measure(GetParam());
    RecordProperty("position", std::to_string(c.position));
    RecordProperty("rotation", std::to_string(c.rotation));
    // 1 where it is honest. Errors of neighbouring frames are alike: the mean over so few seeds scatters.
    // Without IMU the walk's first steps come before its restlessness is known.
    const double most = GetParam() ? 2.0 : 4.0;
    EXPECT_GT(c.position, 0.25);
    EXPECT_LT(c.position, most);
    EXPECT_GT(c.rotation, 0.25);
    EXPECT_LT(c.rotation, most);
}

INSTANTIATE_TEST_SUITE_P(Odometry, Uncertainty, testing::Bool());

}  // namespace
}  // namespace dlod::test
