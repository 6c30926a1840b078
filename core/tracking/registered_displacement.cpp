#include "core/tracking/registered_displacement.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "core/types/multiversion.hpp"

namespace dlod {

namespace {

constexpr float kOutlier_m = 0.15F;      // plane distances are bounded here
constexpr float kMaxNeighbour_m = 1.5F;  // planes end somewhere; as far as that a wall may have come into view
constexpr float kInPlace_m = 0.06F;      // so near the old surface a point has not moved
constexpr double kMostInPlace = 0.4;     // of an object's points, while it moves
constexpr double kLeastInPlace = 0.6;    // while it stands, of those that face either way,
constexpr double kAllInPlace = 0.8;      // or of all
constexpr double kShows_m = 0.075;       // a shorter way may leave a point in place
constexpr int kIterations = 4;
constexpr double kNoise_m = 0.04;     // of a plane distance: pose, range noise, curvature
constexpr double kIndependent = 6.0;  // so many independent points are believed in, however many there are
constexpr double kPrior = 1.5;        // log-odds that a displacement must gain to be believed in
constexpr double kUnexplained_m2 = 2.0 * kPrior * kNoise_m * kNoise_m / kIndependent;  // less leaves no room for that
constexpr double kSlow_mps = 0.3;  // slower motions may hide in the noise
constexpr double kMinObservable = 0.12;
constexpr double kAgainst = -0.7;    // "stayed" for one more frame
constexpr double kMaxFit_m = 0.06;   // a worse fit than that is none
constexpr double kMaxLogOdds = 1.5;  // one registration is no proof
constexpr std::size_t kMinPoints = 10;
constexpr double kAcceleration_mps2 = 2.0;  // of objects
constexpr double kSameSide = 0.77;          // cosine of 40 degrees

/// Horizontal normal at a pixel from its neighbours to the right and below (or left and above).
bool normal_at(const Frame& frame, PixelIndex pixel, Eigen::Vector3f& normal) {
    const OdometryResult& o = frame.odometry;
    const int width = o.x.width();
    const int row = static_cast<int>(pixel) / width;
    const int column = static_cast<int>(pixel) % width;
    const auto at = [&](int r, int c) {
        const auto i = static_cast<std::size_t>(r * width + (c + width) % width);
        return Eigen::Vector3f(o.x[i], o.y[i], o.z[i]);
    };
    const Eigen::Vector3f p = at(row, column);
    const float reach = 0.1F + 0.03F * p.norm();
    const auto edge = [&](const Eigen::Vector3f& a, const Eigen::Vector3f& b, Eigen::Vector3f& out) {
        const Eigen::Vector3f da = a - p, db = p - b;
        const bool near_a = da.squaredNorm() < reach * reach, near_b = db.squaredNorm() < reach * reach;
        out = near_a && near_b ? Eigen::Vector3f(da + db) : near_a ? da : db;
        return near_a || near_b;
    };
    Eigen::Vector3f across, down;
    if (!edge(at(row, column + 1), at(row, column - 1), across)) return false;
    if (!edge(at(std::min(row + 1, o.x.height() - 1), column), at(std::max(row - 1, 0), column), down)) return false;
    normal = across.cross(down);
    const float length = normal.norm();
    if (length < 1e-9F) return false;
    normal /= length;
    return true;
}

using Lanes = std::array<float, PointSample::kCapacity>;

/// Of each point the nearest one before. All lanes run to the capacity: no remainder, whatever the sizes.
DLOD_MULTIVERSION void nearest(std::size_t before, const float* __restrict bx, const float* __restrict by,
                               const float* __restrict bz, const float* __restrict px, const float* __restrict py,
                               const float* __restrict pz, float* __restrict distance2,
                               std::int32_t* __restrict index) {
    for (std::size_t i = 0; i < PointSample::kCapacity; ++i) {
        distance2[i] = std::numeric_limits<float>::max();
        index[i] = 0;
    }
    for (std::size_t j = 0; j < before; ++j) {
        const float x = bx[j], y = by[j], z = bz[j];
        const auto at = static_cast<std::int32_t>(j);
        for (std::size_t i = 0; i < PointSample::kCapacity; ++i) {
            const float dx = px[i] - x, dy = py[i] - y, dz = pz[i] - z;
            const float d2 = dx * dx + dy * dy + dz * dz;
            index[i] = d2 < distance2[i] ? at : index[i];
            distance2[i] = d2 < distance2[i] ? d2 : distance2[i];
        }
    }
}

/// Cost of a displacement and, for the next Gauss-Newton step, its normal equations.
struct Fit {
    double cost_m2 = 0.0;
    Eigen::Matrix2d information = Eigen::Matrix2d::Zero();
    Eigen::Vector2d gradient = Eigen::Vector2d::Zero();
    int inliers = 0;
    int in_place = 0;
    Eigen::Matrix2d seen = Eigen::Matrix2d::Zero();    ///< sum of n n^T over all points
    Eigen::Matrix2d stayed = Eigen::Matrix2d::Zero();  ///< over those in place
};

/// Distances of the points, moved back by d, to the tangent planes of the nearest points before.
Fit fit(const PointSample& before, const PointSample& now, const Eigen::Vector2d& d) {
    Fit f;
    const Eigen::Vector3f between = (now.origin_m - before.origin_m).cast<float>();
    const auto back_x = between.x() - static_cast<float>(d.x()), back_y = between.y() - static_cast<float>(d.y());
    Lanes px, py, pz, distance2;
    std::array<std::int32_t, PointSample::kCapacity> index;
    for (std::size_t i = 0; i < PointSample::kCapacity; ++i) {
        px[i] = now.x[i] + back_x;
        py[i] = now.y[i] + back_y;
        pz[i] = now.z[i] + between.z();
    }
    nearest(before.size, before.x.data(), before.y.data(), before.z.data(), px.data(), py.data(), pz.data(),
            distance2.data(), index.data());
    float xx = 0.0F, xy = 0.0F, yy = 0.0F, gx = 0.0F, gy = 0.0F, cost = 0.0F;
    float all_xx = 0.0F, all_xy = 0.0F, in_xx = 0.0F, in_xy = 0.0F;  // of unit normals: yy = 1 - xx
    for (std::size_t i = 0; i < now.size; ++i) {
        const auto j = static_cast<std::size_t>(index[i]);
        const float nx = before.nx[j], ny = before.ny[j];
        const float distance_m = nx * (px[i] - before.x[j]) + ny * (py[i] - before.y[j]);
        const bool found = distance2[i] < kMaxNeighbour_m * kMaxNeighbour_m;
        const float bounded = found ? std::min(std::abs(distance_m), kOutlier_m) : kOutlier_m;
        cost += bounded * bounded;
        const float own_xx = now.nx[i] * now.nx[i], own_xy = now.nx[i] * now.ny[i];
        all_xx += own_xx;
        all_xy += own_xy;
        if (bounded < kInPlace_m) {
            ++f.in_place;
            in_xx += own_xx;
            in_xy += own_xy;
        }
        if (!found || std::abs(distance_m) > 2.0F * kOutlier_m) continue;
        xx += nx * nx;
        xy += nx * ny;
        yy += ny * ny;
        gx += nx * distance_m;
        gy += ny * distance_m;
        ++f.inliers;
    }
    f.information << xx, xy, xy, yy;
    f.gradient << gx, gy;
    f.seen << all_xx, all_xy, all_xy, static_cast<float>(now.size) - all_xx;
    f.stayed << in_xx, in_xy, in_xy, static_cast<float>(f.in_place) - in_xx;
    f.cost_m2 = cost / static_cast<double>(std::max<std::size_t>(1, now.size));
    return f;
}

/// Smaller eigenvalue of a symmetric matrix, or of a product of two positive ones.
double smaller_eigenvalue(const Eigen::Matrix2d& m) {
    const double half_trace = 0.5 * m.trace();
    return half_trace - std::sqrt(std::max(0.0, half_trace * half_trace - m.determinant()));
}

/// From the mean of the points before to that of those now.
Eigen::Vector2d between_means(const PointSample& before, const PointSample& now) {
    const auto mean = [](const PointSample& s) {
        Eigen::Vector2d sum = Eigen::Vector2d::Zero();
        for (std::size_t i = 0; i < s.size; ++i) sum += Eigen::Vector2d(s.x[i], s.y[i]);
        return Eigen::Vector2d(s.origin_m.head<2>() + sum / static_cast<double>(s.size));
    };
    return mean(now) - mean(before);
}

}  // namespace

void sample_points(const Frame& frame, std::span<const PixelIndex> pixels, PointSample& out) {
    const OdometryResult& o = frame.odometry;
    const Eigen::Matrix3f R = o.T_world_sensor.linear().cast<float>();
    out.origin_m = o.T_world_sensor.translation();
    out.age_s = 0.0;
    out.size = 0;
    // Twice as many places as points: some have no normal.
    const std::size_t places = std::min(pixels.size(), 2 * PointSample::kCapacity);
    for (std::size_t k = 0; k < places && out.size < PointSample::kCapacity; ++k) {
        // Evenly spread places; the order of pixels is that of the segment, so they cover it.
        const PixelIndex pixel = pixels[(k * 2 + 1) * pixels.size() / (2 * places)];
        Eigen::Vector3f n;
        if (!normal_at(frame, pixel, n)) continue;
        n = R * n;
        const float level = n.head<2>().norm();
        if (level < 0.3F) continue;
        const Eigen::Vector3f p = R * Eigen::Vector3f(o.x[pixel], o.y[pixel], o.z[pixel]);
        const std::size_t i = out.size++;
        out.x[i] = p.x();
        out.y[i] = p.y();
        out.z[i] = p.z();
        out.nx[i] = n.x() / level;
        out.ny[i] = n.y() / level;
    }
}

bool show_same_side(const PointSample& before, const PointSample& now, const Eigen::Vector2d& place_m) {
    const auto view = [&place_m](const PointSample& s) { return (place_m - s.origin_m.head<2>()).normalized(); };
    return view(before).dot(view(now)) > kSameSide;
}

RegisteredDisplacement register_displacement(const PointSample& before, const PointSample& now,
                                             const Eigen::Vector2d& guess_m) {
    RegisteredDisplacement best;
    if (before.size < kMinPoints || now.size < kMinPoints) return best;
    const Fit stayed = fit(before, now, Eigen::Vector2d::Zero());
    best.stayed_m2 = best.moved_m2 = stayed.cost_m2;
    best.points = stayed.inliers;
    best.normals = stayed.information / std::max(1, stayed.inliers);
    best.in_place = static_cast<double>(stayed.in_place) / static_cast<double>(now.size);
    if (stayed.inliers > 0) {
        best.observable = smaller_eigenvalue(stayed.information / stayed.inliers);
    }
    if (smaller_eigenvalue(stayed.seen) > kMinObservable * static_cast<double>(now.size))
        best.in_place_every_way = smaller_eigenvalue(stayed.seen.inverse() * stayed.stayed);
    for (const Eigen::Vector2d& start : {Eigen::Vector2d::Zero().eval(), guess_m, between_means(before, now)}) {
        Eigen::Vector2d d = start;
        for (int k = 0; k < kIterations; ++k) {
            const Fit f = d.isZero(0.0) ? stayed : fit(before, now, d);
            if (f.cost_m2 < best.moved_m2) {
                best.moved_m2 = f.cost_m2;
                best.displacement_m = d;
                best.normals = f.information / std::max(1, f.inliers);
                best.points = f.inliers;
            }
            if (f.inliers < static_cast<int>(kMinPoints) / 2) break;
            // A weak pull keeps directions that the normals do not see where they are.
            const Eigen::Matrix2d damped = f.information + 0.05 * f.inliers * Eigen::Matrix2d::Identity();
            const Eigen::Vector2d step = damped.inverse() * f.gradient;
            d += step;
            if (step.norm() < 0.005) break;
        }
        // No displacement from farther off can explain the points so much better than none.
        if (stayed.cost_m2 < kUnexplained_m2) break;
    }
    return best;
}

Eigen::Matrix2d velocity_covariance(const RegisteredDisplacement& r, double elapsed_s) {
    const double fit = kNoise_m * kNoise_m;
    const double changed = 0.5 * kAcceleration_mps2 * elapsed_s;
    return fit / (elapsed_s * elapsed_s) * (r.normals + 1e-3 * Eigen::Matrix2d::Identity()).inverse() +
           changed * changed * Eigen::Matrix2d::Identity();
}

double displacement_chi2(const RegisteredDisplacement& r) {
    return r.points * r.displacement_m.dot(r.normals * r.displacement_m) / (kNoise_m * kNoise_m);
}

bool stands(const RegisteredDisplacement& r, double elapsed_s, double speed_mps, double shift_m) {
    const double way_m = speed_mps * elapsed_s;
    return r.points > 0 && way_m > kShows_m && shift_m < way_m &&
           (r.in_place > kAllInPlace || r.in_place_every_way > kLeastInPlace);
}

double displacement_log_odds(const RegisteredDisplacement& r, double elapsed_s) {
    if (r.stayed_m2 <= 0.0) return 0.0;
    const double noise = kNoise_m * kNoise_m;
    const double gain = 0.5 * kIndependent * (r.stayed_m2 - r.moved_m2) / std::max(noise, r.moved_m2);
    const bool fits = r.moved_m2 < kMaxFit_m * kMaxFit_m && r.in_place < kMostInPlace;
    if (gain > kPrior) return fits ? std::min(gain - kPrior, kMaxLogOdds) : 0.0;
    const bool would_show = kSlow_mps * elapsed_s > 2.0 * kNoise_m && r.observable > kMinObservable;
    return would_show && r.stayed_m2 < 2.0 * noise ? kAgainst : 0.0;
}

}  // namespace dlod
