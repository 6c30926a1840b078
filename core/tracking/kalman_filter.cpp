#include "core/tracking/kalman_filter.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/tracking/bounding_box.hpp"

namespace dlod {

namespace {

constexpr int kMeasured = 7;
constexpr double kGrowthDoubt = 0.5;  // standard deviation of a growth, in itself

double largest_sd(const Eigen::Matrix2d& covariance) {
    const double a = covariance(0, 0), b = covariance(1, 1), c = covariance(0, 1);
    return std::sqrt(0.5 * (a + b) + std::hypot(0.5 * (a - b), c));
}

}  // namespace

KalmanFilter::KalmanFilter(const BoxMeasurement& first, const KalmanConfig& config) {
    state_ << first.box.center_m, wrap_angle(first.box.yaw_rad), first.box.size_m, Eigen::Vector3d::Zero();
    covariance_.setZero();
    covariance_.topLeftCorner<2, 2>() = first.plane_covariance;
    covariance_(kZ, kZ) = first.z_sd_m * first.z_sd_m;
    covariance_(kYaw, kYaw) = first.yaw_sd_rad * first.yaw_sd_rad;
    covariance_.diagonal().segment<3>(kLength) = first.size_sd_m.cwiseAbs2();
    covariance_(kVx, kVx) = covariance_(kVy, kVy) = config.birth_velocity_sd_mps * config.birth_velocity_sd_mps;
    covariance_(kVz, kVz) = config.birth_vertical_velocity_sd_mps * config.birth_vertical_velocity_sd_mps;
}

void KalmanFilter::predict(double dt_s, const KalmanConfig& config) {
    const double dt = std::max(0.0, dt_s);
    state_.head<3>() += dt * state_.segment<3>(kVx);

    // F P F^T with F = I + dt (position, velocity): whole rows, then whole columns.
    covariance_.topRows<3>() += dt * covariance_.bottomRows<3>();
    covariance_.leftCols<3>() += dt * covariance_.rightCols<3>();

    // Accelerations are white: their integral over dt is the noise of velocity, the double integral that of position.
    for (int i = 0; i < 3; ++i) {
        const double a = i < 2 ? config.acceleration_sd_mps2 : config.vertical_acceleration_sd_mps2;
        const double q = a * a;
        covariance_(i, i) += q * dt * dt * dt * dt / 4.0;
        covariance_(i, kVx + i) += q * dt * dt * dt / 2.0;
        covariance_(kVx + i, i) += q * dt * dt * dt / 2.0;
        covariance_(kVx + i, kVx + i) += q * dt * dt;
    }
    covariance_(kYaw, kYaw) += config.yaw_rate_sd_radps * config.yaw_rate_sd_radps * dt * dt;
    for (int i : {kLength, kWidth, kHeight})
        covariance_(i, i) += config.size_rate_sd_mps * config.size_rate_sd_mps * dt * dt;
}

void KalmanFilter::update_one(const Row& measures, double innovation, double variance) {
    // Few of a row's entries are not zero: the position, and the velocity for the age of the points.
    State PHt = State::Zero();
    double expected = variance;
    for (const auto& [state, factor] : measures) {
        if (factor != 0.0) PHt += factor * covariance_.col(state);
    }
    for (const auto& [state, factor] : measures) expected += factor * PHt(state);
    state_ += (innovation / expected) * PHt;
    for (int i = 0; i < kStates; ++i) covariance_.col(i) -= (PHt(i) / expected) * PHt;
}

void KalmanFilter::update(const BoxMeasurement& m, const KalmanConfig& config) {
    // One measured number after the other, which inverts nothing; those of the plane are made independent first.
    // As the points are older than the stamp, a position is measured less age * velocity.
    const Eigen::Vector3d position = m.box.center_m;
    const double shared = m.plane_covariance(0, 1) / m.plane_covariance(0, 0);
    const auto seen = [&](int axis) { return position(axis) - (state_(axis) - m.age_s * state_(kVx + axis)); };
    update_one({{{kX, 1.0}, {kVx, -m.age_s}, {kY, 0.0}, {kVy, 0.0}}}, seen(0), m.plane_covariance(0, 0));
    update_one({{{kY, 1.0}, {kVy, -m.age_s}, {kX, -shared}, {kVx, shared * m.age_s}}}, seen(1) - shared * seen(0),
               m.plane_covariance(1, 1) - shared * m.plane_covariance(0, 1));
    update_one({{{kZ, 1.0}, {kVz, -m.age_s}, {kX, 0.0}, {kY, 0.0}}}, seen(2), m.z_sd_m * m.z_sd_m);
    const auto update_state = [&](int state, double innovation, double sd) {
        update_one({{{state, 1.0}, {state, 0.0}, {state, 0.0}, {state, 0.0}}}, innovation, sd * sd);
    };
    update_state(kYaw, std::remainder(m.box.yaw_rad - state_(kYaw), std::numbers::pi), m.yaw_sd_rad);
    for (int i = 0; i < 3; ++i) update_state(kLength + i, m.box.size_m(i) - state_(kLength + i), m.size_sd_m(i));
    covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();

    state_(kYaw) = wrap_angle(state_(kYaw));
    state_.segment<3>(kLength) = state_.segment<3>(kLength).cwiseMax(config.min_size_m);
    const double speed = state_.segment<3>(kVx).norm();
    if (speed > config.max_speed_mps) state_.segment<3>(kVx) *= config.max_speed_mps / speed;
}

void KalmanFilter::update_velocity(const Eigen::Vector2d& velocity_mps, const Eigen::Matrix2d& covariance) {
    const Eigen::Matrix<double, kStates, 2> PHt = covariance_.block<kStates, 2>(0, kVx);
    const Eigen::Matrix2d S = PHt.block<2, 2>(kVx, 0) + covariance;
    const Eigen::Matrix<double, kStates, 2> K = S.llt().solve(PHt.transpose()).transpose();
    state_ += K * (velocity_mps - state_.segment<2>(kVx));
    covariance_ -= K * PHt.transpose();
    covariance_ = (0.5 * (covariance_ + covariance_.transpose())).eval();
}

void KalmanFilter::align_axes(double reference_yaw_rad) {
    const double quarter = 0.5 * std::numbers::pi;
    const double turns = std::round((reference_yaw_rad - state_(kYaw)) / quarter);
    state_(kYaw) = wrap_angle(state_(kYaw) + turns * quarter);
    if (std::abs(std::remainder(turns, 2.0)) < 0.5) return;
    std::swap(state_(kLength), state_(kWidth));
    covariance_.row(kLength).swap(covariance_.row(kWidth));
    covariance_.col(kLength).swap(covariance_.col(kWidth));
}

void KalmanFilter::grow(double front_m, double back_m, double left_m, double right_m) {
    const Eigen::Vector2d along(std::cos(state_(kYaw)), std::sin(state_(kYaw)));
    const auto move_end = [&](double by_m, const Eigen::Vector2d& outwards, Index size) {
        if (by_m == 0.0) return;
        // The other end stays: whatever size is measured later, the middle follows without any motion.
        State change = State::Zero();
        change.head<2>() = 0.5 * by_m * outwards;
        change(size) = by_m;
        state_ += change;
        covariance_ += kGrowthDoubt * kGrowthDoubt * change * change.transpose();
    };
    move_end(front_m, along, kLength);
    move_end(back_m, -along, kLength);
    move_end(left_m, {-along.y(), along.x()}, kWidth);
    move_end(right_m, {along.y(), -along.x()}, kWidth);
}

void KalmanFilter::doubt_size(double sd_m) {
    for (int i : {kLength, kWidth}) covariance_(i, i) = std::max(covariance_(i, i), sd_m * sd_m);
}

double KalmanFilter::plane_distance2(const Eigen::Vector2d& position_m, double age_s,
                                     const Eigen::Matrix2d& covariance) const {
    const Eigen::Vector2d innovation = position_m - (state_.head<2>() - age_s * state_.segment<2>(kVx));
    const Eigen::Matrix2d cross = covariance_.block<2, 2>(kX, kVx);
    const Eigen::Matrix2d S = covariance_.topLeftCorner<2, 2>() - age_s * (cross + cross.transpose()) +
                              age_s * age_s * covariance_.block<2, 2>(kVx, kVx) + covariance;
    return innovation.dot(S.llt().solve(innovation));
}

OrientedBox KalmanFilter::box() const {
    OrientedBox box;
    box.center_m = state_.head<3>();
    box.yaw_rad = state_(kYaw);
    box.size_m = state_.segment<3>(kLength);
    return box;
}

double KalmanFilter::position_sd() const {
    return largest_sd(covariance_.topLeftCorner<2, 2>());
}

double KalmanFilter::velocity_sd() const {
    return largest_sd(covariance_.block<2, 2>(kVx, kVx));
}

Eigen::Matrix<double, 6, 6> KalmanFilter::motion_covariance() const {
    Eigen::Matrix<double, 6, 6> out;
    out.topLeftCorner<3, 3>() = covariance_.topLeftCorner<3, 3>();
    out.topRightCorner<3, 3>() = covariance_.block<3, 3>(kX, kVx);
    out.bottomLeftCorner<3, 3>() = covariance_.block<3, 3>(kVx, kX);
    out.bottomRightCorner<3, 3>() = covariance_.block<3, 3>(kVx, kVx);
    return out;
}

}  // namespace dlod
