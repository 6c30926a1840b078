#include "core/odometry/moving_points.hpp"

#include <gtest/gtest.h>

#include <random>

namespace dlod {
namespace {

constexpr double kMargin_m = 0.25;

PlacedPoints random_points(std::size_t count) {
    std::mt19937 random(2);
    std::uniform_real_distribution<float> place(-4.0F, 4.0F);
    PlacedPoints points;
    for (std::size_t i = 0; i < count; ++i) {
        points.x.push_back(place(random));
        points.y.push_back(place(random));
        points.z.push_back(0.4F * place(random));
    }
    return points;
}

MovingBox box(const Eigen::Vector3d& center, double yaw, const Eigen::Vector3d& size, const Eigen::Vector3d& velocity) {
    MovingBox moving;
    moving.box = {center, yaw, size};
    moving.velocity_mps = velocity;
    return moving;
}

TEST(MovingPoints, AreThoseInsideTheBoxesMovedOnToTheStamp) {
    const Eigen::Vector3d origin_m(100.0, -50.0, 3.0);
    const std::vector<MovingBox> boxes = {box({101, -51, 3}, 0.5, {2.0, 0.6, 1.7}, {1.5, -0.5, 0}),
                                          box({98, -48, 3}, -1.2, {0.5, 0.5, 1.0}, {0, 0, 0})};
    MovingPoints moving;
    moving.set(boxes, 1'000'000'000);
    const PlacedPoints placed = random_points(20000);
    std::vector<std::uint8_t> excluded(placed.size(), 0);
    moving.mark(placed, origin_m, 1'400'000'000, excluded);
    int inside = 0;
    for (std::size_t i = 0; i < placed.size(); ++i) {
        const Eigen::Vector3d p = origin_m + Eigen::Vector3f(placed.x[i], placed.y[i], placed.z[i]).cast<double>();
        bool surely = false, perhaps = false;
        for (const MovingBox& b : boxes) {
            OrientedBox moved = b.box;
            moved.center_m += 0.4 * b.velocity_mps;
            surely = surely || moved.contains(p, kMargin_m - 1e-4);
            perhaps = perhaps || moved.contains(p, kMargin_m + 1e-4);
        }
        if (surely == perhaps) {
            EXPECT_EQ(excluded[i], surely ? 1 : 0);
        }
        inside += excluded[i];
    }
    EXPECT_GT(inside, 300);
}

TEST(MovingPoints, OldBoxesAndThoseOfTheFutureSayNothing) {
    MovingPoints moving;
    const PlacedPoints placed = random_points(100);
    const std::vector<MovingBox> everything = {box({0, 0, 0}, 0.0, {100, 100, 100}, {0, 0, 0})};
    const auto marked = [&](std::int64_t stamp_ns) {
        std::vector<std::uint8_t> excluded(placed.size(), 0);
        moving.mark(placed, Eigen::Vector3d::Zero(), stamp_ns, excluded);
        return std::count(excluded.begin(), excluded.end(), 1);
    };
    EXPECT_EQ(marked(0), 0);
    moving.set(everything, 10'000'000'000);
    EXPECT_EQ(marked(10'100'000'000), 100);
    EXPECT_EQ(marked(12'000'000'000), 0);
    EXPECT_EQ(marked(9'000'000'000), 0);
    moving.set({}, 10'000'000'000);
    EXPECT_EQ(marked(10'100'000'000), 0);
}

TEST(MovingPoints, ACrowdBeyondTheBoundIsCutNotOverrun) {
    const std::vector<MovingBox> crowd(1000, box({0, 0, 0}, 0.0, {100, 100, 100}, {0, 0, 0}));
    MovingPoints moving;
    moving.set(crowd, 0);
    const PlacedPoints placed = random_points(10);
    std::vector<std::uint8_t> excluded(placed.size(), 0);
    moving.mark(placed, Eigen::Vector3d::Zero(), 0, excluded);
    for (const std::uint8_t e : excluded) EXPECT_EQ(e, 1);
}

}  // namespace
}  // namespace dlod
