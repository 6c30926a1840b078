#include "core/odometry/motion_filter.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace dlod {
namespace {

// Order of the error state, in blocks of three.
constexpr int kPosition = 0;
constexpr int kRotation = 3;
constexpr int kVelocity = 6;
constexpr int kRate = 9;
constexpr int kAccelerometerBias = 12;
constexpr int kGravity = 15;

constexpr double kPredictionStep_s = 2.5e-3;
constexpr double kCovarianceStep_s = 0.1;
constexpr std::int64_t kLongGap_ns = 350'000'000;
constexpr double kKnownPose = 1e-4;           // standard deviation of the pose that the world begins with: m, rad
constexpr double kUnknownVelocity_mps = 3.0;  // standard deviation at the start
// Without IMU: time over which the robot's accelerations are averaged.
constexpr double kMotionMemory_s = 1.0;
// A body that has been seen not to move: how well velocity and turn rate are zero.
constexpr double kStanding_mps = 1e-3;
constexpr double kStanding_radps = 1e-3;
// Variance of a block that the present mode does not know: so small that it stays what it is.
constexpr double kFrozen = 1e-12;
// A body at rest: how well its velocity is zero, and beyond how many standard deviations it is not believed to be.
constexpr double kRest_mps = 0.03;
constexpr double kRestDeviations = 3.0;

std::int64_t nanoseconds(double seconds) {
    return std::llround(seconds * 1e9);
}

}  // namespace

MotionFilter::MotionFilter(const MotionFilterConfig& config, const Eigen::Isometry3d& T_body_sensor)
    : config_(config), T_body_sensor_(T_body_sensor) {}

void MotionFilter::initialize(const Eigen::Isometry3d& T_world_sensor, const Eigen::Vector3d& gravity_mps2,
                              std::int64_t stamp_ns, const ImuBuffer* imu) {
    const Eigen::Isometry3d T_world_body = T_world_sensor * T_body_sensor_.inverse();
    state_ = MotionState{};
    state_.rotation = Eigen::Quaterniond(T_world_body.rotation()).normalized();
    state_.position_m = T_world_body.translation();
    state_.gravity_mps2 = gravity_mps2;
    stamp_ns_ = stamp_ns;
    start_ns_ = stamp_ns;
    forget(kPosition, kKnownPose);
    forget(kRotation, kKnownPose);
    forget(kVelocity, kUnknownVelocity_mps);
    imu_ = nullptr;
    use_imu(imu);
}

void MotionFilter::use_imu(const ImuBuffer* imu) {
    if (imu_ == nullptr && imu == nullptr) {
        state_.rate_radps.setZero();
    } else if (imu == nullptr) {
        state_.rate_radps = body_rate(state_, stamp_ns_);
    } else {
        state_.rate_radps.setZero();
    }
    imu_ = imu;
    forget(kRate, imu != nullptr ? 0.01 : 1.0);
    if (imu != nullptr) {
        forget(kAccelerometerBias, 0.05);
        forget(kGravity, 0.3);
    } else {
        state_.accelerometer_bias_mps2.setZero();
        forget(kAccelerometerBias, std::sqrt(kFrozen));
        forget(kGravity, std::sqrt(kFrozen));
    }
}

Eigen::Vector3d MotionFilter::body_rate(const MotionState& s, std::int64_t time_ns) const {
    if (imu_ == nullptr) return s.rate_radps;
    return imu_->at(time_ns).angular_velocity_radps - s.rate_radps;
}

/// What of a turn rate goes on for long: a robot pitches and rolls to and fro, and turns about the vertical.
Eigen::Vector3d MotionFilter::lasting(const MotionState& s, const Eigen::Vector3d& rate_radps) {
    const Eigen::Vector3d down = s.rotation.conjugate() * s.gravity_mps2.normalized();
    return down * down.dot(rate_radps);
}

/// Moves the state by dt, which may be negative, with the readings in the middle.
void MotionFilter::advance(MotionState& s, std::int64_t mid_ns, double dt) const {
    if (imu_ != nullptr && !imu_->is_silent_at(mid_ns)) {
        dlod::advance(s, imu_->at(mid_ns), dt);
        return;
    }
    // A constant velocity in the body's axes: the path is an arc.
    const Eigen::Vector3d rate =
        imu_ != nullptr ? lasting(s, imu_->mean_rate_before(mid_ns) - s.rate_radps) : s.rate_radps;
    dlod::advance(s, rate, (s.rotation * rate).cross(s.velocity_mps), dt);
}

void MotionFilter::predict(std::int64_t stamp_ns) {
    if (imu_ == nullptr && stamp_ns - stamp_ns_ > kLongGap_ns) state_.rate_radps = lasting(state_, state_.rate_radps);
    while (stamp_ns_ < stamp_ns) {
        const MotionState before = state_;
        const std::int64_t target = std::min(stamp_ns, stamp_ns_ + nanoseconds(kCovarianceStep_s));
        const double dt = static_cast<double>(target - stamp_ns_) * 1e-9;
        const int steps = std::max(1, static_cast<int>(std::ceil(dt / kPredictionStep_s)));
        const double h = dt / steps;
        for (int i = 0; i < steps; ++i) advance(state_, stamp_ns_ + nanoseconds((i + 0.5) * h), h);
        const bool silent = imu_ != nullptr && imu_->is_silent_at(stamp_ns_ + (target - stamp_ns_) / 2);
        silent_s_ = silent ? silent_s_ + dt : 0.0;
        grow_covariance(before, (state_.velocity_mps - before.velocity_mps) / dt, dt);
        stamp_ns_ = target;
    }
}

void MotionFilter::stand(std::int64_t stamp_ns) {
    state_.velocity_mps.setZero();
    state_.rate_radps.setZero();
    forget(kVelocity, kStanding_mps);
    forget(kRate, kStanding_radps);
    stamp_ns_ = stamp_ns;
}

void MotionFilter::grow_covariance(const MotionState& before, const Eigen::Vector3d& acceleration, double dt) {
    Matrix F = Matrix::Identity();
    Matrix Q = Matrix::Zero();
    const Eigen::Matrix3d R = before.rotation.toRotationMatrix();
    F.block<3, 3>(kPosition, kVelocity).diagonal().setConstant(dt);
    const auto noise = [&](int block, double density) {
        Q.diagonal().segment<3>(block).array() += density * density * dt;
    };
    double velocity_density;
    if (imu_ != nullptr) {
        F.block<3, 3>(kRotation, kRate) = -dt * R;
        if (silent_s_ == 0.0) {
            const Eigen::Matrix3d force = skew(acceleration - before.gravity_mps2);
            F.block<3, 3>(kVelocity, kRotation) = -dt * force;
            F.block<3, 3>(kVelocity, kAccelerometerBias) = -dt * R;
            F.block<3, 3>(kVelocity, kGravity).diagonal().setConstant(dt);
            F.block<3, 3>(kPosition, kRotation) = -0.5 * dt * dt * force;
            F.block<3, 3>(kPosition, kAccelerometerBias) = -0.5 * dt * dt * R;
            F.block<3, 3>(kPosition, kGravity).diagonal().setConstant(0.5 * dt * dt);
        }
        noise(kRotation, config_.gyro_noise);
        noise(kRate, config_.gyro_bias_walk);
        noise(kAccelerometerBias, config_.accelerometer_bias_walk);
        velocity_density = config_.accelerometer_noise;
        if (silent_s_ > 0.0) {
            // A turn rate that walks for that long: what this step adds.
            const double before_s = std::max(0.0, silent_s_ - dt);
            const double walked = silent_s_ * silent_s_ * silent_s_ - before_s * before_s * before_s;
            Q.diagonal().segment<3>(kRotation).array() +=
                config_.angular_acceleration * config_.angular_acceleration * walked / 3.0;
            velocity_density = config_.acceleration;
        }
    } else {
        F.block<3, 3>(kRotation, kRate) = dt * R;
        F.block<3, 3>(kVelocity, kRate) = -dt * skew(before.velocity_mps) * R;
        noise(kRate, config_.angular_acceleration);
        const double rotation = config_.angular_acceleration * config_.angular_acceleration * dt * dt * dt / 3.0;
        Q.diagonal().segment<3>(kRotation).array() += rotation;
        Q.block<3, 3>(kRotation, kRate) +=
            0.5 * dt * dt * config_.angular_acceleration * config_.angular_acceleration * R;
        Q.block<3, 3>(kRate, kRotation) = Q.block<3, 3>(kRotation, kRate).transpose();
        velocity_density = config_.acceleration;
    }
    noise(kVelocity, velocity_density);
    const double q = velocity_density * velocity_density;
    Q.diagonal().segment<3>(kPosition).array() += q * dt * dt * dt / 3.0;
    Q.block<3, 3>(kPosition, kVelocity).diagonal().array() += 0.5 * q * dt * dt;
    Q.block<3, 3>(kVelocity, kPosition).diagonal().array() += 0.5 * q * dt * dt;
    covariance_ = F * covariance_ * F.transpose() + Q;
    covariance_ = 0.5 * (covariance_ + covariance_.transpose()).eval();
}

void MotionFilter::sweep(double duration_s, const Eigen::Vector3d& origin_m, SweepMotion& motion) const {
    constexpr int kLast = SweepMotion::kKnots - 1;
    const double h = duration_s / kLast;
    motion.duration_s = static_cast<float>(duration_s);
    MotionState s = state_;
    s.position_m -= origin_m;
    for (int k = kLast; k >= 0; --k) {
        const Eigen::Matrix3d R = (s.rotation.toRotationMatrix() * T_body_sensor_.linear());
        const Eigen::Vector3d t = s.position_m + s.rotation * T_body_sensor_.translation();
        for (int i = 0; i < 3; ++i) {
            for (int j = 0; j < 3; ++j) motion.rows[k][4 * i + j] = static_cast<float>(R(i, j));
            motion.rows[k][4 * i + 3] = static_cast<float>(t[i]);
        }
        if (k > 0) advance(s, stamp_ns_ - nanoseconds((kLast - k + 0.5) * h), -h);
    }
}

void MotionFilter::begin_update() {
    prior_ = state_;
    prior_deviation_ = covariance_.diagonal().cwiseSqrt();
    prior_information_ = covariance_.ldlt().solve(Matrix::Identity());
    information_ = prior_information_;
}

Vector6d MotionFilter::step(const NormalEquations& equations, const Observability::Directions& held) {
    // The points' h is about (position, rotation) at their own time; dt turns it into (velocity, rate) at the stamp.
    const double share = imu_ != nullptr ? config_.information_share : config_.information_share_without_imu;
    Matrix6d G = Matrix6d::Identity();
    G.block<3, 3>(3, 3) = (imu_ != nullptr ? -1.0 : 1.0) * state_.rotation.toRotationMatrix();
    information_ = prior_information_;
    information_.block<6, 6>(0, 0) += share * equations.A[0];
    const Matrix6d cross = share * equations.A[1] * G;
    information_.block<6, 6>(0, 6) += cross;
    information_.block<6, 6>(6, 0) += cross.transpose();
    information_.block<6, 6>(6, 6) += share * G.transpose() * equations.A[2] * G;
    const Vector change = difference(state_, prior_);
    Vector gradient = prior_information_ * change;
    gradient.segment<6>(0) += share * equations.b[0];
    gradient.segment<6>(6) += share * G.transpose() * equations.b[1];
    // What is held goes back to the prediction; the rest is solved for given that.
    held_.setZero(kStates, 2 * held.cols());
    held_.topLeftCorner(6, held.cols()) = held;
    held_.block(6, held.cols(), 6, held.cols()) = G.transpose() * held;
    Vector error = -held_ * (held_.transpose() * change);
    if (held.cols() > 0) {
        const Matrix free = Matrix::Identity() - held_ * held_.transpose();
        gradient = (free * (gradient + information_ * error)).eval();
        information_ = (free * information_ * free + held_ * held_.transpose()).eval();
    }
    error += information_.ldlt().solve(-gradient);
    apply(state_, error);
    return error.head<6>();
}

void MotionFilter::finish_update() {
    see_motion();
    const Matrix prior = covariance_;
    covariance_ = information_.ldlt().solve(Matrix::Identity());
    if (held_.cols() > 0) {
        // What is held keeps its uncertainty, and the rest depends on it as the prediction says (a consider filter).
        const Matrix free = Matrix::Identity() - held_ * held_.transpose();
        const auto effect = (held_ - covariance_ * free * prior_information_ * held_).eval();
        covariance_ -= held_ * held_.transpose();
        covariance_ += effect * (held_.transpose() * prior * held_) * effect.transpose();
    }
    covariance_ = 0.5 * (covariance_ + covariance_.transpose()).eval();
}

/// The robot's accelerations are as large as the scans show the prediction to be wrong: by a variance of q dt^3 / 3.
void MotionFilter::see_motion() {
    const double dt = static_cast<double>(stamp_ns_ - updated_ns_) * 1e-9;
    updated_ns_ = stamp_ns_;
    if (imu_ != nullptr || held_.cols() > 0 || dt <= 0.0 || dt > kMotionMemory_s) return;
    const Vector change = correction();
    const auto follow = [&](double& density2, int block) {
        const double seen = change.segment<3>(block).squaredNorm() / (dt * dt * dt);
        density2 += dt / kMotionMemory_s * (seen - density2);
    };
    follow(acceleration2_, kPosition);
    follow(angular_acceleration2_, kRotation);
}

/// A straight line fitted to an integrated random walk of density q over a time T misses its end by a variance of
/// q T^3 / 105.
Matrix6d MotionFilter::sweep_noise(double duration_s) const {
    Matrix6d noise = Matrix6d::Zero();
    if (imu_ != nullptr) return noise;
    const double share = duration_s * duration_s * duration_s / 105.0;
    noise.diagonal().head<3>().setConstant(acceleration2_ * share);
    noise.diagonal().tail<3>().setConstant(angular_acceleration2_ * share);
    return noise;
}

void MotionFilter::observe_rest(const Eigen::Vector3d& direction) {
    const double velocity = direction.dot(state_.velocity_mps);
    const Vector column = covariance_.middleCols<3>(kVelocity) * direction;
    const double variance = direction.dot(column.segment<3>(kVelocity));
    if (velocity * velocity > kRestDeviations * kRestDeviations * variance) return;
    const Vector gain = column / (variance + kRest_mps * kRest_mps);
    apply(state_, -velocity * gain);
    covariance_ -= gain * column.transpose();
    covariance_ = 0.5 * (covariance_ + covariance_.transpose()).eval();
}

void MotionFilter::doubt_gravity(double deviation_mps2) {
    forget(kGravity, deviation_mps2);
}

void MotionFilter::begin_world(const Eigen::Isometry3d& T_world_sensor, double gravity_deviation_mps2) {
    const Eigen::Isometry3d T_world_body = T_world_sensor * T_body_sensor_.inverse();
    const Eigen::Quaterniond rotation = Eigen::Quaterniond(T_world_body.rotation()).normalized();
    const Eigen::Matrix3d R_new_old = (rotation * state_.rotation.conjugate()).toRotationMatrix();
    state_.rotation = rotation;
    state_.position_m = T_world_body.translation();
    state_.velocity_mps = R_new_old * state_.velocity_mps;
    state_.gravity_mps2 = MotionState{}.gravity_mps2;
    covariance_.middleRows<3>(kVelocity) = (R_new_old * covariance_.middleRows<3>(kVelocity)).eval();
    covariance_.middleCols<3>(kVelocity) = (covariance_.middleCols<3>(kVelocity) * R_new_old.transpose()).eval();
    forget(kPosition, kKnownPose);
    forget(kRotation, kKnownPose);
    forget(kGravity, gravity_deviation_mps2);
}

/// What is known of this block is a standard deviation, and nothing that it has to do with others.
void MotionFilter::forget(int block, double deviation) {
    covariance_.middleRows<3>(block).setZero();
    covariance_.middleCols<3>(block).setZero();
    covariance_.diagonal().segment<3>(block).setConstant(deviation * deviation);
}

MotionFilter::Vector MotionFilter::correction() const {
    return difference(state_, prior_);
}

MotionFilter::Vector MotionFilter::difference(const MotionState& a, const MotionState& b) {
    Vector d;
    d << a.position_m - b.position_m, so3_log(a.rotation * b.rotation.conjugate()), a.velocity_mps - b.velocity_mps,
        a.rate_radps - b.rate_radps, a.accelerometer_bias_mps2 - b.accelerometer_bias_mps2,
        a.gravity_mps2 - b.gravity_mps2;
    return d;
}

void MotionFilter::apply(MotionState& s, const Vector& error) {
    s.position_m += error.segment<3>(kPosition);
    s.rotation = (so3_exp(error.segment<3>(kRotation)) * s.rotation).normalized();
    s.velocity_mps += error.segment<3>(kVelocity);
    s.rate_radps += error.segment<3>(kRate);
    s.accelerometer_bias_mps2 += error.segment<3>(kAccelerometerBias);
    s.gravity_mps2 += error.segment<3>(kGravity);
}

void MotionFilter::forget_velocity() {
    forget(kVelocity, kUnknownVelocity_mps);
}

void MotionFilter::set_motion(const Eigen::Vector3d& velocity_mps, const Eigen::Vector3d& rate_radps) {
    state_.velocity_mps = velocity_mps;
    state_.rate_radps = rate_radps;
}

void MotionFilter::move(const Eigen::Vector3d& offset_m, double turn_rad) {
    const Eigen::Quaterniond turn(Eigen::AngleAxisd(turn_rad, Eigen::Vector3d::UnitZ()));
    state_.position_m += offset_m;
    state_.rotation = (turn * state_.rotation).normalized();
    state_.velocity_mps = turn * state_.velocity_mps;
}

Eigen::Isometry3d MotionFilter::T_world_sensor() const {
    return orthonormalized(make_pose(state_.rotation, state_.position_m) * T_body_sensor_);
}

Eigen::Vector3d MotionFilter::sensor_angular_velocity() const {
    return T_body_sensor_.linear().transpose() * body_rate(state_, stamp_ns_);
}

Eigen::Vector3d MotionFilter::sensor_linear_velocity() const {
    const Eigen::Vector3d body = state_.rotation.conjugate() * state_.velocity_mps +
                                 body_rate(state_, stamp_ns_).cross(T_body_sensor_.translation());
    return T_body_sensor_.linear().transpose() * body;
}

ImuCorrection MotionFilter::imu_correction() const {
    ImuCorrection correction;
    if (imu_ != nullptr) correction.gyro_bias_radps = state_.rate_radps;
    correction.accelerometer_bias_mps2 = state_.accelerometer_bias_mps2;
    correction.gravity_mps2 = state_.gravity_mps2;
    correction.velocity_covariance = covariance_.block<3, 3>(kVelocity, kVelocity);
    return correction;
}

Matrix6d MotionFilter::pose_covariance() const {
    // The sensor sits at an offset from the body: a rotation about the body moves it.
    Matrix6d J = Matrix6d::Identity();
    J.block<3, 3>(0, 3) = -skew(state_.rotation * T_body_sensor_.translation());
    return J * covariance_.block<6, 6>(0, 0) * J.transpose();
}

double MotionFilter::position_deviation_m() const {
    return std::sqrt(pose_covariance().diagonal().head<3>().sum());
}

}  // namespace dlod
