#include "core/odometry/witnesses.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace dlod::test {
namespace {

/// A scan whose points have been matched, each at its own distance from its plane.
class View {
  public:
    /// A patch of so many points of an upright surface, two metres wide.
    void see(int points, double x, double y, double nx, double ny, double off_m) {
        for (int i = 0; i < points; ++i) {
            const double along = 2.0 * i / points - 1.0;
            add(x - ny * along, y + nx * along, nx, ny, 0.0, off_m);
        }
    }
    void see_ground(int points) {
        for (int i = 0; i < points; ++i) add(0.1 * i, 0.0, 0.0, 0.0, 1.0, 0.0);
    }
    Witnesses witnesses() {
        scan_.begin(points_, 1'000'000'000, 0.1);
        scan_.choose_origin(Eigen::Vector3d::Zero(), 0.4);
        MotionFilter filter(MotionFilterConfig{}, Eigen::Isometry3d::Identity());
        filter.initialize(Eigen::Isometry3d::Identity(), {0.0, 0.0, -9.8}, 1'000'000'000, nullptr);
        scan_.move(filter);
        matches_.reserve(off_m_.size());
        matches_.clear();
        for (std::size_t i = 0; i < off_m_.size(); ++i) {
            const float normal[3] = {points_.nx[i], points_.ny[i], points_.nz[i]};
            const float lever[3] = {points_.x[i], points_.y[i], points_.z[i]};
            matches_.push(normal, lever, off_m_[i], 1e4F, 0.0F, 0, static_cast<std::uint32_t>(i));
        }
        matches_.flat = matches_.count;
        return {scan_, matches_};
    }
    /// Seen after the same from where the map was made.
    bool are_more_than_one_body() {
        View before = *this;
        std::fill(before.off_m_.begin(), before.off_m_.end(), 0.0F);
        return witnesses().are_more_than_one_body(before.witnesses());
    }

  private:
    void add(double x, double y, double nx, double ny, double nz, double off_m) {
        points_.pixel.push_back(static_cast<PixelIndex>(points_.size()));
        points_.measurement.push_back(0);
        points_.x.push_back(static_cast<float>(x));
        points_.y.push_back(static_cast<float>(y));
        points_.nx.push_back(static_cast<float>(nx));
        points_.ny.push_back(static_cast<float>(ny));
        points_.nz.push_back(static_cast<float>(nz));
        points_.planarity.push_back(1.0F);
        for (auto* values : {&points_.z, &points_.time_s, &points_.tx, &points_.ty, &points_.tz})
            values->push_back(0.0F);
        off_m_.push_back(static_cast<float>(off_m));
    }

    PointSelection points_;
    std::vector<float> off_m_;
    PlacedScan scan_;
    PlaneMatches matches_;
};

constexpr double kOff_m = 0.3;

/// Facades along x.
View street() {
    View view;
    view.see_ground(500);
    for (const double x : {-20.0, -10.0, 0.0, 10.0, 20.0}) {
        view.see(80, x, 8.0, 0.0, -1.0, 0.01);
        view.see(80, x, -8.0, 0.0, 1.0, 0.01);
    }
    return view;
}

TEST(Witnesses, WhatOneVehicleTellsIsNoMotionOfTheRobot) {
    View view = street();
    view.see(70, 6.0, 0.0, -1.0, 0.0, 0.01);
    EXPECT_FALSE(view.are_more_than_one_body());
    // Things that disagree make it no better.
    view.see(10, 30.0, 7.0, -1.0, 0.0, kOff_m);
    view.see(10, -20.0, -7.0, 1.0, 0.0, kOff_m);
    EXPECT_FALSE(view.are_more_than_one_body());
}

TEST(Witnesses, OthersThatAgreeTellIt) {
    View view = street();
    view.see(70, 6.0, 0.0, -1.0, 0.0, 0.01);
    view.see(8, 30.0, 7.0, -1.0, 0.0, 0.01);
    EXPECT_TRUE(view.are_more_than_one_body());
    // Most of the others that could do not.
    view.see(30, -20.0, -7.0, 1.0, 0.0, kOff_m);
    EXPECT_FALSE(view.are_more_than_one_body());
}

TEST(Witnesses, WhereNothingFacesADirectionThePredictionHoldsIt) {
    View view = street();
    EXPECT_TRUE(view.are_more_than_one_body());
    // But much that does, and none of it where the map has it, shows that the motion is another one.
    view.see(70, 6.0, 0.0, -1.0, 0.0, kOff_m);
    EXPECT_FALSE(view.are_more_than_one_body());
}

TEST(Witnesses, ARobotThatStandsSeesSurfacesOfAllDirectionsAgain) {
    View view = street();
    EXPECT_TRUE(view.witnesses().see_the_same(15.0));
    view.see(10, 6.0, 0.0, -1.0, 0.0, kOff_m);
    EXPECT_TRUE(view.witnesses().see_the_same(15.0));
    // However little there is along the street.
    view.see(10, -6.0, 0.0, 1.0, 0.0, kOff_m);
    EXPECT_FALSE(view.witnesses().see_the_same(15.0));
}

}  // namespace
}  // namespace dlod::test
