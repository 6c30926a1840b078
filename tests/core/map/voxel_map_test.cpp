#include "core/map/voxel_map.hpp"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <map>
#include <random>
#include <tuple>

namespace dlod {
namespace {

std::vector<FixedPoint> random_points(std::size_t count, std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_int_distribution<std::int32_t> place(-20000, 20000);
    std::normal_distribution<double> direction;
    std::vector<FixedPoint> points;
    for (std::size_t i = 0; i < count; ++i) {
        const Eigen::Vector3d n =
            Eigen::Vector3d(direction(random), direction(random), direction(random)).normalized() * kNormalUnits;
        points.push_back({place(random), place(random), place(random) / 10, static_cast<std::int16_t>(n.x()),
                          static_cast<std::int16_t>(n.y()), static_cast<std::int16_t>(n.z())});
        if (i % 3 == 0) points.back().nx = points.back().ny = points.back().nz = 0;
    }
    return points;
}

TEST(VoxelMap, FitsWhatADirectComputationGives) {
    VoxelMapConfig config;
    VoxelMap map(config);
    const auto points = random_points(5000, 3);
    map.add(points);
    std::map<std::tuple<int, int, int>, std::vector<FixedPoint>> slow;
    for (const FixedPoint& p : points) {
        const auto cell = [](std::int32_t v) { return static_cast<int>(std::floor(v * kMapUnit_m / 0.5)); };
        slow[{cell(p.x), cell(p.y), cell(p.z)}].push_back(p);
    }
    EXPECT_EQ(map.size(), slow.size());
    for (const auto& [key, inside] : slow) {
        const auto [x, y, z] = key;
        const VoxelPlane* plane = map.find({x, y, z});
        ASSERT_NE(plane, nullptr);
        ASSERT_EQ(plane->points, inside.size());
        const Eigen::Vector3d center = (Eigen::Vector3d(x, y, z).array() + 0.5) * 0.5;
        Eigen::Vector3d mean = Eigen::Vector3d::Zero();
        Eigen::Matrix3d square = Eigen::Matrix3d::Zero();
        const auto weight_of = [](const FixedPoint& p) {
            return p.nx == 0 && p.ny == 0 && p.nz == 0 ? 1 : kFlatWeight;
        };
        double weights = 0.0;
        for (const FixedPoint& p : inside) weights += weight_of(p);
        for (const FixedPoint& p : inside) {
            const double share = weight_of(p) / weights;
            const Eigen::Vector3d q = Eigen::Vector3d(p.x, p.y, p.z) * kMapUnit_m - center;
            const Eigen::Vector3d n = Eigen::Vector3d(p.nx, p.ny, p.nz) / kNormalUnits;
            mean += share * q;
            square += share * q * q.transpose();
            const double disc = 0.25 * config.surfel_radius_m * config.surfel_radius_m;
            if (!n.isZero()) square += share * disc * (Eigen::Matrix3d::Identity() - n * n.transpose());
        }
        const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(square - mean * mean.transpose());
        EXPECT_LT((Eigen::Vector3f(plane->mean[0], plane->mean[1], plane->mean[2]).cast<double>() - mean).norm(), 1e-5);
        EXPECT_NEAR(plane->extent_m[0], std::sqrt(solver.eigenvalues()[2]), 1e-3);
        EXPECT_NEAR(plane->thickness_m, std::max(config.noise_m, std::sqrt(std::max(0.0, solver.eigenvalues()[0]))),
                    1e-3);
    }
    EXPECT_EQ(map.find({1000, 0, 0}), nullptr);
}

TEST(VoxelMap, AddingAndRemovingIsExactWhateverTheOrder) {
    VoxelMap direct{VoxelMapConfig{}};
    VoxelMap busy{VoxelMapConfig{}};
    const auto a = random_points(3000, 1);
    const auto b = random_points(3000, 2);
    const auto c = random_points(3000, 3);
    direct.add(b);
    busy.add(a);
    busy.add(b);
    busy.add(c);
    busy.remove(a);
    busy.add(a);
    busy.remove(c);
    busy.remove(a);
    ASSERT_EQ(direct.size(), busy.size());
    for (const FixedPoint& p : b) {
        const VoxelPlane* x = direct.find(direct.index_of(p));
        const VoxelPlane* y = busy.find(busy.index_of(p));
        ASSERT_NE(y, nullptr);
        for (int i = 0; i < 3; ++i) {
            EXPECT_EQ(x->mean[i], y->mean[i]);
            EXPECT_EQ(x->normal[i], y->normal[i]);
        }
        EXPECT_EQ(x->thickness_m, y->thickness_m);
    }
    busy.remove(b);
    EXPECT_EQ(busy.size(), 0U);
    EXPECT_EQ(busy.find(busy.index_of(b[0])), nullptr);
}

TEST(VoxelMap, ClutterDoesNotTiltAPlane) {
    // A floor, and on one side of the voxel a few points of something that stands on it.
    std::mt19937_64 random(8);
    std::uniform_int_distribution<std::int32_t> place(100, 1900);
    std::vector<FixedPoint> points;
    for (int i = 0; i < 60; ++i) points.push_back({place(random), place(random), 400, 0, 0, kNormalUnits});
    for (int i = 0; i < 6; ++i) points.push_back({1800, place(random), 400 + 80 * i, 0, 0, 0});
    VoxelMap map{VoxelMapConfig{}};
    map.add(points);
    const VoxelPlane* plane = map.find({0, 0, 0});
    ASSERT_NE(plane, nullptr);
    EXPECT_TRUE(plane->flat);
    EXPECT_GT(std::abs(plane->normal[2]), 0.9999F);
    EXPECT_NEAR(plane->mean[2], 400 * kMapUnit_m - 0.25, 1e-3);
}

TEST(VoxelMap, ADoorFrameBesideAWallKeepsItsOwnPlane) {
    // A wall that faces +y, a narrow face towards -x before it, and the other side of the thin wall.
    std::mt19937_64 random(8);
    std::uniform_int_distribution<std::int32_t> place(100, 1900);
    std::vector<FixedPoint> points;
    for (int i = 0; i < 60; ++i) points.push_back({place(random), 400, place(random), 0, kNormalUnits, 0});
    for (int i = 0; i < 8; ++i) points.push_back({1500, 400 + 40 * i, place(random), -kNormalUnits, 0, 0});
    for (int i = 0; i < 30; ++i) points.push_back({place(random), 100, place(random), 0, -kNormalUnits, 0});
    VoxelMap map{VoxelMapConfig{}};
    map.add(points);
    const auto expect = [&](const Eigen::Vector3f& normal, int axis, std::int32_t at) {
        const VoxelPlane* plane = map.find_facet({0, 0, 0}, normal.data());
        ASSERT_NE(plane, nullptr);
        EXPECT_GT(std::abs(plane->normal[axis]), 0.999F);
        EXPECT_NEAR(plane->mean[axis], at * kMapUnit_m - 0.25, 1e-3);
    };
    expect({0.1F, 0.99F, 0.0F}, 1, 400);
    expect({-0.95F, 0.2F, 0.1F}, 0, 1500);
    expect({0.0F, -1.0F, 0.0F}, 1, 100);
    const float away[3] = {0.9F, 0.0F, 0.0F};
    const VoxelPlane* none = map.find_facet({0, 0, 0}, away);
    EXPECT_TRUE(none == nullptr || std::abs(none->normal[0]) < 0.1F);
    EXPECT_EQ(map.find_facet({5, 0, 0}, away), nullptr);
}

TEST(VoxelMap, WalksAllOccupiedNeighboursOnce) {
    VoxelMap map{VoxelMapConfig{}};
    const auto points = random_points(20000, 5);
    map.add(points);
    for (std::size_t i = 0; i < 500; ++i) {
        const VoxelIndex center = map.index_of(points[i]);
        std::map<std::tuple<int, int, int>, int> seen;
        map.for_each_around(center, [&](VoxelIndex v, const VoxelPlane& plane) {
            ++seen[{v.x, v.y, v.z}];
            EXPECT_EQ(&plane, map.find(v));
        });
        for (int dx = -1; dx <= 1; ++dx) {
            for (int dy = -1; dy <= 1; ++dy) {
                for (int dz = -1; dz <= 1; ++dz) {
                    const VoxelIndex v{center.x + dx, center.y + dy, center.z + dz};
                    const int expected = map.find(v) != nullptr ? 1 : 0;
                    EXPECT_EQ(seen.contains({v.x, v.y, v.z}) ? 1 : 0, expected);
                }
            }
        }
        for (const auto& [key, count] : seen) EXPECT_EQ(count, 1);
    }
}

}  // namespace
}  // namespace dlod
