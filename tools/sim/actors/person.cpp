#include "tools/sim/actors/person.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/types/lie.hpp"

namespace dlod::tools::sim {
namespace {

// Lengths as shares of the body height (usual anthropometric figures).
constexpr double kThigh = 0.245;
constexpr double kShin = 0.246;
constexpr double kFootHeight = 0.042;
constexpr double kTorsoLength = 0.30;
constexpr double kUpperArm = 0.172;
constexpr double kForearm = 0.157;
constexpr double kHeadRadius = 0.068;

enum PartIndex { kTorsoPart, kPelvis, kNeck, kHead, kHairPart, kSide };
enum SidePart { kThighPart, kShinPart, kFoot, kUpperArmPart, kForearmPart, kHand, kSideParts };

/// Turned forward by an angle: what hangs down swings to +x.
Eigen::Isometry3d swing(const Vec3& joint, double angle_rad) {
    return make_pose(Eigen::Quaterniond(Eigen::AngleAxisd(-angle_rad, Vec3::UnitY())), joint);
}

/// A kLimb that hangs down from the joint's frame.
Eigen::Isometry3d hanging(const Eigen::Isometry3d& joint) {
    return joint * Eigen::AngleAxisd(std::numbers::pi, Vec3::UnitX());
}

}  // namespace

Person::Person(Motion motion, Terrain terrain, Random& random)
    : Actor("person", std::move(motion), std::move(terrain)),
      height_m_(random.uniform(1.55, 1.93)),
      build_(random.uniform(0.88, 1.2)),
      arm_swing_(random.uniform(0.4, 1.0)),
      stance_phase_(random.uniform(0.0, 6.0)),
      backpack_(random.chance(0.35)) {
    constexpr std::array kCloth{Material::kLightCloth, Material::kMediumCloth, Material::kDarkCloth};
    const Material top = kCloth[static_cast<std::size_t>(random.integer(0, 2))];
    const Material trousers = kCloth[static_cast<std::size_t>(random.integer(0, 2))];
    const double h = height_m_;
    const double b = build_;
    parts_.resize(kSide + 2 * kSideParts);
    parts_[kTorsoPart] = {kTorso, {0.070 * h * b, 0.118 * h * b, kTorsoLength * h}, top};
    parts_[kPelvis] = {kBall, {0.072 * h * b, 0.098 * h * b, 0.065 * h}, trousers};
    parts_[kNeck] = {kLimb, {0.034 * h, 0.034 * h, 0.06 * h}, Material::kSkin};
    parts_[kHead] = {kBall, {kHeadRadius * h * 0.85, kHeadRadius * h * 0.72, kHeadRadius * h}, Material::kSkin};
    parts_[kHairPart] = {
        kBall, {kHeadRadius * h * 0.8, kHeadRadius * h * 0.76, kHeadRadius * h * 0.7}, Material::kHair};
    for (int side = 0; side < 2; ++side) {
        Part* p = &parts_[static_cast<std::size_t>(kSide + side * kSideParts)];
        p[kThighPart] = {kLimb, {0.048 * h * b, 0.048 * h * b, kThigh * h}, trousers};
        p[kShinPart] = {kLimb, {0.033 * h * b, 0.033 * h * b, kShin * h}, trousers};
        p[kFoot] = {kBlock, {0.150 * h, 0.052 * h, kFootHeight * h}, Material::kDarkCloth};
        p[kUpperArmPart] = {kLimb, {0.028 * h * b, 0.028 * h * b, kUpperArm * h}, top};
        p[kForearmPart] = {kLimb, {0.022 * h * b, 0.022 * h * b, kForearm * h}, top};
        p[kHand] = {kBall, {0.016 * h, 0.024 * h, 0.048 * h}, Material::kSkin};
    }
    if (backpack_) parts_.push_back({kBlock, {0.2, 0.3, 0.45}, Material::kDarkCloth});
}

Person::Leg Person::leg(double phase, double speed_mps) const {
    const double moving = std::min(1.0, speed_mps / 0.4);
    // Half a stride is a step: the feet reach as far as the ground moves below.
    const double step_m = 0.5 * stride_m(speed_mps);
    const double reach = moving * std::asin(std::min(0.6, 0.5 * step_m / (0.5 * height_m_)));
    const double running = std::clamp((speed_mps - 2.0) / 1.5, 0.0, 1.0);
    const double lift = std::max(0.0, std::cos(phase));  // while it swings forward
    return {.hip_rad = reach * (std::sin(phase) + 0.15) + 0.25 * running * lift,
            .knee_rad = 0.04 + moving * (0.08 + (0.8 + 0.7 * running) * lift * lift)};
}

void Person::place(double t, std::vector<Eigen::Isometry3d>& T_world_part) const {
    const double phase = motion()(t)[3];
    const double v = Actor::speed(t);
    const double moving = std::min(1.0, v / 0.4);
    const double running = std::clamp((v - 2.0) / 1.5, 0.0, 1.0);
    const double h = height_m_;
    const std::array<Leg, 2> legs{leg(phase, v), leg(phase + std::numbers::pi, v)};

    // The lower foot stands on the ground.
    double pelvis = 0.0;
    for (const Leg& l : legs) {
        pelvis = std::max(pelvis, (kThigh * std::cos(l.hip_rad) + kShin * std::cos(l.hip_rad - l.knee_rad)) * h);
    }
    pelvis += kFootHeight * h;

    const Eigen::Isometry3d T_world_base = base(t);
    // Leans into a run; who stands sways a little.
    const double lean = 0.03 + 0.22 * running + (1.0 - moving) * 0.02 * std::sin(0.9 * t + stance_phase_);
    const Eigen::Isometry3d body =
        T_world_base * make_pose(Eigen::Quaterniond(Eigen::AngleAxisd(lean, Vec3::UnitY())), Vec3(0.0, 0.0, pelvis));

    T_world_part[kPelvis] = T_world_base * make_pose(Eigen::Quaterniond::Identity(), Vec3(0.0, 0.0, pelvis));
    T_world_part[kTorsoPart] = body * make_pose(Eigen::Quaterniond::Identity(), Vec3(0.0, 0.0, 0.02 * h));
    const double shoulder = kTorsoLength * h;
    T_world_part[kNeck] = body * make_pose(Eigen::Quaterniond::Identity(), Vec3(0.005 * h, 0.0, shoulder - 0.02 * h));
    T_world_part[kHead] =
        body * make_pose(Eigen::Quaterniond::Identity(), Vec3(0.015 * h, 0.0, shoulder + 0.04 * h + kHeadRadius * h));
    T_world_part[kHairPart] =
        T_world_part[kHead] * make_pose(Eigen::Quaterniond::Identity(), Vec3(-0.012 * h, 0.0, 0.022 * h));
    for (int side = 0; side < 2; ++side) {
        const double left = side == 0 ? 1.0 : -1.0;
        Eigen::Isometry3d* part = &T_world_part[static_cast<std::size_t>(kSide + side * kSideParts)];
        const Leg& l = legs[static_cast<std::size_t>(side)];
        const Eigen::Isometry3d hip = T_world_base * swing(Vec3(0.0, left * 0.052 * h * build_, pelvis), l.hip_rad);
        const Eigen::Isometry3d knee = hip * swing(Vec3(0.0, 0.0, -kThigh * h), -l.knee_rad);
        part[kThighPart] = hanging(hip);
        part[kShinPart] = hanging(knee);
        const double sole = -(l.hip_rad - l.knee_rad) * 0.6;  // feet stay flatter than shins
        const Eigen::Isometry3d ankle = knee * swing(Vec3(0.0, 0.0, -kShin * h), sole);
        part[kFoot] = ankle * make_pose(Eigen::Quaterniond::Identity(), Vec3(0.045 * h, 0.0, -0.5 * kFootHeight * h));

        // Arms go against their leg.
        const double opposite = std::sin(phase + (side == 0 ? std::numbers::pi : 0.0));
        const double arm = moving * arm_swing_ * (0.45 + 0.35 * running) * opposite;
        const double elbow = 0.25 + 1.2 * running + moving * 0.15 * opposite +
                             (1.0 - moving) * 0.5 * (1.0 + std::sin(0.5 * t + stance_phase_ + left));
        Eigen::Isometry3d joint = body * swing(Vec3(0.0, left * 0.118 * h * build_, shoulder - 0.035 * h), arm);
        joint = joint * Eigen::AngleAxisd(left * 0.08, Vec3::UnitX());
        const Eigen::Isometry3d forearm = joint * swing(Vec3(0.0, 0.0, -kUpperArm * h), elbow);
        part[kUpperArmPart] = hanging(joint);
        part[kForearmPart] = hanging(forearm);
        part[kHand] = forearm * make_pose(Eigen::Quaterniond::Identity(), Vec3(0.0, 0.0, -(kForearm + 0.035) * h));
    }
    if (backpack_) {
        const double back = 0.070 * h * build_ + 0.09;
        T_world_part.back() = body * make_pose(Eigen::Quaterniond::Identity(), Vec3(-back, 0.0, 0.62 * shoulder));
    }
}

}  // namespace dlod::tools::sim
