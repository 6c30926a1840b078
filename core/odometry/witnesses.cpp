#include "core/odometry/witnesses.hpp"

#include <Eigen/Core>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/odometry/frame_registration.hpp"

namespace dlod {
namespace {

// A robot that stands, or nearly, sees so much of its first scan again.
constexpr double kSameShare = 0.85;
// For that: directions in the plan.
constexpr std::size_t kDirections = 4;
// Surfaces turned by more than this are no longer upright: sine of 45 degrees, squared.
constexpr float kUpright = 0.5F;
// Facing: within 60 degrees.
constexpr float kFacing = 0.5F;
// What is within this distance may be of one body: half of a van's length.
constexpr float kBody_m = 3.0F;
// Without that body so many points make a witness, if they are this share of those that face its direction. Of points
// that are matched with something else a fifth lies on it by chance, as a match may be off by five times as much.
constexpr double kLeastWitnesses = 5.0;
constexpr double kLeastShare = 0.3;

}  // namespace

Witnesses::Witnesses(const PlacedScan& scan, const PlaneMatches& matches) {
    const PlacedPoints& placed = scan.placed();
    std::vector<std::uint8_t> found(scan.left_out().size(), 0);
    for (std::size_t i = 0; i < matches.flat; ++i) {
        found[matches.point[i]] = FrameRegistration::lies_on_plane(matches, i) ? 1 : 0;
    }
    points_.reserve(found.size());
    for (std::size_t i = 0; i < found.size(); ++i) {
        if (!scan.takes_part(i) || !scan.points().is_flat(i)) continue;
        points_.push_back({placed.x[i], placed.y[i], placed.nx[i], placed.ny[i], found[i] != 0});
    }
}

bool Witnesses::see_the_same(double least_points) const {
    double flat = 0.0;
    std::array<double, kDirections> seen{};
    std::array<double, kDirections> again{};
    for (const Point& p : points_) {
        flat += p.found ? 1.0 : 0.0;
        if (p.nx * p.nx + p.ny * p.ny < kUpright) continue;
        // Both sides of a surface are one direction. The axes lie in the middle of theirs.
        const double half_turns =
            std::atan2(static_cast<double>(p.ny), static_cast<double>(p.nx)) / std::numbers::pi + 2.0;
        const auto k = static_cast<std::size_t>(half_turns * kDirections + 0.5) % kDirections;
        ++seen[k];
        again[k] += p.found ? 1.0 : 0.0;
    }
    if (flat < kSameShare * static_cast<double>(points_.size())) return false;
    for (std::size_t k = 0; k < kDirections; ++k) {
        if (seen[k] >= least_points && again[k] < kSameShare * seen[k]) return false;
    }
    return true;
}

/// Of the upright surfaces within 60 degrees of this direction, those that lie where the map has them.
std::vector<Witnesses::Point> Witnesses::facing(const Eigen::Vector2f& direction) const {
    std::vector<Point> facing;
    std::copy_if(points_.begin(), points_.end(), std::back_inserter(facing), [&](const Point& p) {
        return p.found && std::abs(p.nx * direction.x() + p.ny * direction.y()) > kFacing;
    });
    return facing;
}

bool Witnesses::are_more_than_one_body(const Witnesses& before) const {
    Eigen::Matrix2f information = Eigen::Matrix2f::Zero();
    for (const Point& p : points_) {
        if (p.found) information += Eigen::Vector2f(p.nx, p.ny) * Eigen::RowVector2f(p.nx, p.ny);
    }
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix2f> solver;
    solver.computeDirect(information);
    const Eigen::Vector2f told_least = solver.eigenvectors().col(0);
    const std::vector<Point> speak = facing(told_least);
    const std::vector<Point> might = before.facing(told_least);
    const auto count_near = [](const std::vector<Point>& points, const Point& body) {
        return std::count_if(points.begin(), points.end(), [&](const Point& p) {
            const float dx = p.x - body.x;
            const float dy = p.y - body.y;
            return dx * dx + dy * dy < kBody_m * kBody_m;
        });
    };
    std::ptrdiff_t of_body = 0;
    const Point* body = nullptr;
    for (const Point& p : speak) {
        const std::ptrdiff_t count = count_near(speak, p);
        if (count <= of_body) continue;
        of_body = count;
        body = &p;
    }
    auto others = static_cast<double>(speak.size());
    auto all_others = static_cast<double>(might.size());
    if (static_cast<double>(of_body) < kLeastWitnesses) {
        // Nothing claims to tell it. If nothing could, the prediction holds it.
        return kLeastShare * all_others < kLeastWitnesses;
    }
    others -= static_cast<double>(of_body);
    all_others -= static_cast<double>(count_near(might, *body));
    return others >= std::max(kLeastWitnesses, kLeastShare * all_others);
}

}  // namespace dlod
