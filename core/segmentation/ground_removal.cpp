#include "core/segmentation/ground_removal.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "core/types/multiversion.hpp"

namespace dlod {
namespace {

constexpr double kHistogramBin_m = 0.05;
// Distance over which the line filter's height half forgets: without progress outwards it does not move, so that it
// does not climb walls.
constexpr float kHeightMemory_m = 0.1F;
constexpr float kSlopeGain = 0.2F;
constexpr float kShortestBase_m = 0.3F;   // returns nearer to each other say nothing about the slope
constexpr int kRowsAbove = 2;             // slopes are taken over so many rows: between adjacent ones noise prevails
constexpr double kGravityMemory_s = 3.0;  // braking and steps deceive an accelerometer for shorter times
constexpr int kRowStep = 2;               // of the pixels that the normal of the ground is taken from
constexpr int kColumnStep = 16;
constexpr float kAround = 5.0F;             // how far the ground around reaches, in heights of the sensor
constexpr float kAroundTolerance_m = 0.1F;  // of its points from a plane
constexpr float kAroundSlope = 0.1F;        // growth of that in the first round, with distance
constexpr int kFewestAround = 50;
constexpr float kMostFromGravity = 0.9F;  // cosine
constexpr float kUpGain = 0.5F;
// Range noise allowed in a slope, as a share of what a wall would rise over those rows.
constexpr float kNoiseShare = 0.3F;

/// Distance and height of one row of points with respect to the vertical (ux, uy, uz).
DLOD_MULTIVERSION_512 void cylindrical_row(int width, const float* __restrict x, const float* __restrict y,
                                           const float* __restrict z, float ux, float uy, float uz, float min_range,
                                           float* __restrict distance, float* __restrict height) {
    const float min_squared = min_range * min_range;
    for (int c = 0; c < width; ++c) {
        const float h = ux * x[c] + uy * y[c] + uz * z[c];
        const float squared = x[c] * x[c] + y[c] * y[c] + z[c] * z[c];
        const float horizontal = squared - h * h;
        const float d = std::sqrt(horizontal > 1e-6F ? horizontal : 1e-6F);
        distance[c] = squared > min_squared ? d : 0.0F;
        height[c] = h;
    }
}

/// The same for every kColumnStep-th column. Exact where there is a return, whatever its range.
DLOD_MULTIVERSION_512 void sample_cylindrical_row(int samples, const float* __restrict x, const float* __restrict y,
                                                  const float* __restrict z, float ux, float uy, float uz,
                                                  float* __restrict distance, float* __restrict height) {
    for (int i = 0; i < samples; ++i) {
        const int c = i * kColumnStep;
        const float h = ux * x[c] + (uy * y[c] + uz * z[c]);
        const float horizontal = x[c] * x[c] + (y[c] * y[c] + z[c] * z[c]) - h * h;
        distance[i] = std::sqrt(horizontal > 0.0F ? horizontal : 0.0F);
        height[i] = h;
    }
}

struct LineFilterParameters {
    float max_slope;
    float height_tolerance;
    float slope_tolerance;
    float max_step;
};

/// One row of all columns' line filters; `above` is kRowsAbove rows up, `wall_rise` what a wall rises to there per
/// metre of distance.
DLOD_MULTIVERSION_512 void follow_ground_row(int width, const float* __restrict distance,
                                             const float* __restrict height, const float* __restrict distance_above,
                                             const float* __restrict height_above, LineFilterParameters p,
                                             float wall_rise, float* __restrict line_distance,
                                             float* __restrict line_height, float* __restrict line_slope,
                                             float* __restrict line_started, std::uint8_t* __restrict ground) {
    for (int c = 0; c < width; ++c) {
        const float base = distance[c] - line_distance[c];
        const float predicted = line_height[c] + line_slope[c] * base;
        const float error = height[c] - predicted;
        // Flat towards the next return above: then the surface may rise from here (a kerb, the foot of a ramp).
        const float rise = height_above[c] - height[c];
        const float run = distance_above[c] - distance[c];
        const bool flat = (distance_above[c] > 0.0F) & (run > 0.0F) &
                          (std::abs(rise) < p.max_slope * run + kNoiseShare * wall_rise * distance[c]);
        const float grown_flat = p.height_tolerance + p.max_slope * base;
        const float grown_steep = p.height_tolerance + p.slope_tolerance * base;
        float tolerance = flat ? grown_flat : grown_steep;
        tolerance = tolerance < p.max_step ? tolerance : p.max_step;
        // Nothing stands below the ground: downwards the line may bend more.
        const float below = 2.0F * p.height_tolerance + p.max_slope * base;
        const bool started = line_started[c] > 0.0F;
        const bool on_line =
            (distance[c] > 0.0F) & (base > -0.05F) & (error < tolerance) & (error > -below) & (started | flat);
        const float arm = base > kShortestBase_m ? base : kShortestBase_m;
        const float progress = base > 0.0F ? base : 0.0F;
        const float height_gain = progress / (progress + kHeightMemory_m);
        float slope = line_slope[c] + kSlopeGain * error / arm;
        slope = slope < p.max_slope ? slope : p.max_slope;
        slope = slope > -p.max_slope ? slope : -p.max_slope;
        line_distance[c] = on_line ? distance[c] : line_distance[c];
        line_height[c] = on_line ? predicted + height_gain * error : line_height[c];
        line_slope[c] = on_line ? slope : line_slope[c];
        line_started[c] = on_line ? 1.0F : line_started[c];
        ground[c] = on_line ? 1 : 0;
    }
}

}  // namespace

GroundRemoval::GroundRemoval(const SensorModel& sensor, const GroundRemovalConfig& config)
    : sensor_(sensor),
      config_(config),
      distance_(kRows, sensor.width),
      height_(kRows, sensor.width),
      sampled_distance_(kRows, (sensor.width + kColumnStep - 1) / kColumnStep),
      sampled_height_(kRows, sampled_distance_.width()) {
    const auto width = static_cast<std::size_t>(sensor.width);
    for (auto* v : {&line_distance_, &line_height_, &line_slope_, &line_started_}) v->assign(width, 0.0F);
    for (std::size_t r = 0; r < static_cast<std::size_t>(sensor.height); ++r) {
        const std::size_t above = r < kRowsAbove ? 0 : r - kRowsAbove;
        wall_rise_.push_back(std::abs(std::tan(sensor.altitude_rad[above]) - std::tan(sensor.altitude_rad[r])));
    }
    const double span = std::max(0.0, config.max_sensor_height_m - config.min_sensor_height_m);
    histogram_.assign(static_cast<std::size_t>(span / kHistogramBin_m) + 2, 0);
    around_.reserve(static_cast<std::size_t>(sampled_distance_.width()) *
                    static_cast<std::size_t>((sensor.height + kRowStep - 1) / kRowStep));
}

void GroundRemoval::update_gravity(const Frame& frame) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (const ImuSample& sample : frame.imu) sum += sample.acceleration_mps2;
    const Eigen::Vector3f mean = sensor_.T_sensor_imu.linear().cast<float>() *
                                 (frame.imu.empty() ? sum : sum / static_cast<float>(frame.imu.size()));
    // A reading far from 1 g is a shock or a faulty IMU.
    if (std::abs(mean.norm() - 9.81F) > 2.0F) return;
    const float gain = started_ ? static_cast<float>(sensor_.frame_period_s / kGravityMemory_s) : 1.0F;
    gravity_up_ = (gravity_up_ + gain * (mean.normalized() - gravity_up_)).normalized();
    if (!started_) up_ = gravity_up_;
    started_ = true;
}

void GroundRemoval::update_up(const Frame& frame) {
    const Eigen::Vector3f side = up_.unitOrthogonal();
    const Eigen::Vector3f front = up_.cross(side);
    const auto farthest = kAround * static_cast<float>(sensor_height_m_);
    const StructuredCloud& cloud = frame.cloud;
    around_.clear();
    for (int r = sensor_.height - 1; r >= 0; r -= kRowStep) {
        for (int c = 0; c < sensor_.width; c += kColumnStep) {
            if (frame.prepared.ground(r, c) == 0 || cloud.range_m(r, c) > 2.0F * farthest) continue;
            const Eigen::Vector3f p(cloud.x(r, c), cloud.y(r, c), cloud.z(r, c));
            const Eigen::Vector3f q(side.dot(p), front.dot(p), up_.dot(p));
            if (q.head<2>().squaredNorm() <= farthest * farthest) around_.push_back(q);
        }
    }
    // Twice: the second time without what does not lie in the first plane, kerbs and feet.
    Eigen::Vector3f plane(0.0F, 0.0F, static_cast<float>(-sensor_height_m_));
    int used = 0;
    for (const float slope : {kAroundSlope, 0.0F}) {
        Eigen::Matrix3f A = Eigen::Matrix3f::Zero();
        Eigen::Vector3f b = Eigen::Vector3f::Zero();
        used = 0;
        for (const Eigen::Vector3f& q : around_) {
            const Eigen::Vector3f row(q.x(), q.y(), 1.0F);
            if (std::abs(q.z() - plane.dot(row)) > kAroundTolerance_m + slope * row.head<2>().norm()) continue;
            A += row * row.transpose();
            b += row * q.z();
            ++used;
        }
        if (used < kFewestAround) break;
        plane = (A + 1e-3F * Eigen::Matrix3f::Identity()).ldlt().solve(b);
    }
    Eigen::Vector3f normal = gravity_up_;
    if (used >= kFewestAround) normal = (up_ - plane.x() * side - plane.y() * front).normalized();
    if (normal.dot(gravity_up_) < kMostFromGravity) normal = gravity_up_;
    up_ = (up_ + kUpGain * (normal - up_)).normalized();
}

int GroundRemoval::top_row() const {
    constexpr double kSteepest_rad = 0.35;  // hills seen from below
    const double highest = kSteepest_rad + std::acos(std::clamp(static_cast<double>(up_.z()), -1.0, 1.0));
    int row = 0;
    while (row + 1 < sensor_.height &&
           static_cast<double>(sensor_.altitude_rad[static_cast<std::size_t>(row)]) > highest)
        ++row;
    return row;
}

void GroundRemoval::update_sensor_height(const StructuredCloud& cloud) {
    // Height of the lowest well populated level of flat returns around the sensor.
    std::fill(histogram_.begin(), histogram_.end(), 0);
    const auto max_slope = static_cast<float>(std::tan(config_.max_slope_rad));
    const auto min_range = static_cast<float>(config_.min_range_m);
    const auto highest = static_cast<float>(-config_.min_sensor_height_m);
    constexpr float kFarthest_m = 15.0F;
    const int samples = sampled_distance_.width();
    const auto sample_row = [&](int r) {
        sample_cylindrical_row(samples, cloud.x.row(r), cloud.y.row(r), cloud.z.row(r), up_.x(), up_.y(), up_.z(),
                               sampled_distance_.row(r % kRows), sampled_height_.row(r % kRows));
    };
    const int bottom = sensor_.height - 1;
    const int top = std::max(kRowsAbove, top_row());
    for (int r = bottom; r > bottom - kRowsAbove && r >= 0; --r) sample_row(r);
    for (int r = bottom; r >= top; --r) {
        const int above = r - kRowsAbove;
        sample_row(above);
        const float wall_rise = wall_rise_[static_cast<std::size_t>(r)];
        const float* range = cloud.range_m.row(r);
        const float* range_above = cloud.range_m.row(above);
        for (int i = 0; i < samples; ++i) {
            const float height = sampled_height_(r % kRows, i);
            const float distance = sampled_distance_(r % kRows, i);
            const float run = sampled_distance_(above % kRows, i) - distance;
            if (height > highest || run <= 0.0F) continue;
            const int c = i * kColumnStep;
            if (range[c] < min_range || range[c] > kFarthest_m || range_above[c] == 0.0F) continue;
            const float rise = sampled_height_(above % kRows, i) - height;
            if (std::abs(rise) > max_slope * run + kNoiseShare * wall_rise * distance) continue;
            const auto bin = static_cast<std::size_t>((-static_cast<double>(height) - config_.min_sensor_height_m) /
                                                      kHistogramBin_m);
            if (bin + 1 < histogram_.size()) ++histogram_[bin];
        }
    }
    const auto level = [this](std::size_t bin) { return histogram_[bin] + histogram_[bin + 1]; };
    int most = 0;
    for (std::size_t bin = 0; bin + 1 < histogram_.size(); ++bin) most = std::max(most, level(bin));
    constexpr int kFewest = 8;
    if (most < kFewest) return;
    for (std::size_t bin = histogram_.size() - 1; bin-- > 0;) {
        if (level(bin) * 5 < most * 2) continue;
        if (bin > 0 && level(bin - 1) > level(bin)) --bin;
        const double weight = level(bin);
        sensor_height_m_ =
            config_.min_sensor_height_m +
            kHistogramBin_m * (static_cast<double>(bin) + 0.5 + static_cast<double>(histogram_[bin + 1]) / weight);
        return;
    }
}

void GroundRemoval::process(Frame& frame) {
    update_gravity(frame);
    update_sensor_height(frame.cloud);
    if (sensor_height_m_ == 0.0) {
        frame.prepared.ground.fill(0);
        return;
    }
    follow_ground(frame);
    update_up(frame);
    if (settled_) return;
    follow_ground(frame);
    settled_ = true;
}

void GroundRemoval::follow_ground(Frame& frame) {
    std::fill(line_distance_.begin(), line_distance_.end(), 0.0F);
    std::fill(line_height_.begin(), line_height_.end(), static_cast<float>(-sensor_height_m_));
    std::fill(line_slope_.begin(), line_slope_.end(), 0.0F);
    std::fill(line_started_.begin(), line_started_.end(), 0.0F);
    const LineFilterParameters parameters{
        static_cast<float>(std::tan(config_.max_slope_rad)), static_cast<float>(config_.height_tolerance_m),
        static_cast<float>(config_.slope_tolerance), static_cast<float>(config_.max_step_m)};
    const StructuredCloud& cloud = frame.cloud;
    const auto prepare_row = [&](int r) {
        cylindrical_row(sensor_.width, cloud.x.row(r), cloud.y.row(r), cloud.z.row(r), up_.x(), up_.y(), up_.z(),
                        static_cast<float>(config_.min_range_m), distance_.row(r % kRows), height_.row(r % kRows));
    };
    const int bottom = sensor_.height - 1;
    const int top = top_row();
    for (int r = bottom; r > bottom - kRowsAbove && r >= 0; --r) prepare_row(r);
    for (int r = bottom; r >= top; --r) {
        const int above = std::max(r - kRowsAbove, 0);
        if (r >= kRowsAbove) prepare_row(above);
        follow_ground_row(sensor_.width, distance_.row(r % kRows), height_.row(r % kRows), distance_.row(above % kRows),
                          height_.row(above % kRows), parameters, wall_rise_[static_cast<std::size_t>(r)],
                          line_distance_.data(), line_height_.data(), line_slope_.data(), line_started_.data(),
                          frame.prepared.ground.row(r));
    }
    std::fill(frame.prepared.ground.data(), frame.prepared.ground.row(top), std::uint8_t{0});
}

}  // namespace dlod
