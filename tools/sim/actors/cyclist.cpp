#include "tools/sim/actors/cyclist.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/types/lie.hpp"

namespace dlod::tools::sim {
namespace {

constexpr double kWheelRadius_m = 0.335;
constexpr double kWheelBase_m = 1.05;
constexpr double kGearRatio = 2.4;
constexpr double kCrank_m = 0.17;
constexpr double kThigh_m = 0.44;
constexpr double kShin_m = 0.46;
const Vec3 kCrankAxis(-0.08, 0.0, 0.29);
const Vec3 kHip(-0.26, 0.0, 1.0);
const Vec3 kShoulder(0.12, 0.0, 1.43);
const Vec3 kGrip(0.42, 0.0, 1.05);

enum PartIndex { kFrame, kFrontWheel, kRearWheel, kTorsoPart, kPelvis, kHead, kHelmet, kSide };
enum SidePart { kThighPart, kShinPart, kFoot, kUpperArmPart, kForearmPart, kSideParts };

/// A kLimb from a to b.
Eigen::Isometry3d between(const Vec3& a, const Vec3& b) {
    return make_pose(Eigen::Quaterniond::FromTwoVectors(Vec3::UnitZ(), b - a), a);
}

/// Where two bars of given lengths from a and b meet, in a plane of constant y, on the side of +x.
Vec3 joint_between(const Vec3& a, const Vec3& b, double from_a_m, double from_b_m) {
    const Vec3 d = b - a;
    const double length = std::min(d.norm(), 0.999 * (from_a_m + from_b_m));
    const double along = (length * length + from_a_m * from_a_m - from_b_m * from_b_m) / (2.0 * length);
    const double aside = std::sqrt(std::max(0.0, from_a_m * from_a_m - along * along));
    const Vec3 direction = d.normalized();
    Vec3 normal(-direction.z(), 0.0, direction.x());
    if (normal.x() < 0.0) normal = -normal;
    return a + along * direction + aside * normal.normalized();
}

}  // namespace

Mesh bicycle_frame_mesh() {
    Mesh m;
    const Vec3 rear(-0.5 * kWheelBase_m, 0.0, kWheelRadius_m);
    const Vec3 front(0.5 * kWheelBase_m, 0.0, kWheelRadius_m);
    const Vec3 seat(-0.24, 0.0, 0.88);
    const Vec3 head(0.36, 0.0, 0.85);
    const auto bar = [&](const Vec3& a, const Vec3& b, double r) { m.add_bar(a, b, r, Material::kLightPaint, 6); };
    bar(rear, kCrankAxis, 0.014);
    bar(rear, seat, 0.012);
    bar(kCrankAxis, seat, 0.018);
    bar(kCrankAxis, head, 0.022);
    bar(seat, head, 0.018);
    bar(front, head, 0.018);
    bar(head, Vec3(0.34, 0.0, 1.02), 0.015);
    m.add_bar(kGrip - Vec3(0.05, 0.29, 0.0), kGrip - Vec3(0.05, -0.29, 0.0), 0.015, Material::kRubber, 6);
    m.add_box(Vec3(-0.26, 0.0, 0.92), Vec3(0.26, 0.14, 0.06), 0.0, Material::kRubber);
    m.add_box(Vec3(-0.62, 0.0, 0.62), Vec3(0.02, 0.06, 0.06), 0.0, Material::kRetroreflector);
    return m;
}

Mesh bicycle_wheel_mesh() {
    constexpr int kSides = 16;
    Mesh m;
    const auto rim = [&](int i) {
        const double a = 2.0 * std::numbers::pi * i / kSides;
        return Vec3((kWheelRadius_m - 0.02) * std::cos(a), 0.0, (kWheelRadius_m - 0.02) * std::sin(a));
    };
    for (int i = 0; i < kSides; ++i) {
        m.add_bar(rim(i), rim(i + 1), 0.022, Material::kRubber, 5);
        if (i % 2 == 0) m.add_bar(Vec3::Zero(), rim(i), 0.003, Material::kMetal, 3);
    }
    return m;
}

Cyclist::Cyclist(Motion motion, Terrain terrain, int frame_shape, int wheel_shape, Random& random)
    : Actor("cyclist", std::move(motion), std::move(terrain)) {
    const Material jacket = random.chance(0.5) ? Material::kLightCloth : Material::kMediumCloth;
    parts_.resize(kSide + 2 * kSideParts);
    parts_[kFrame] = {.shape = frame_shape, .own_materials = true};
    parts_[kFrontWheel] = {.shape = wheel_shape, .own_materials = true};
    parts_[kRearWheel] = parts_[kFrontWheel];
    parts_[kTorsoPart] = {kTorso, {0.13, 0.20, (kShoulder - kHip).norm() + 0.05}, jacket};
    parts_[kPelvis] = {kBall, {0.13, 0.17, 0.12}, Material::kDarkCloth};
    parts_[kHead] = {kBall, {0.10, 0.085, 0.12}, Material::kSkin};
    parts_[kHelmet] = {kBall, {0.14, 0.1, 0.09}, Material::kPlastic};
    for (int side = 0; side < 2; ++side) {
        Part* p = &parts_[static_cast<std::size_t>(kSide + side * kSideParts)];
        p[kThighPart] = {kLimb, {0.085, 0.085, kThigh_m}, Material::kDarkCloth};
        p[kShinPart] = {kLimb, {0.055, 0.055, kShin_m}, Material::kMediumCloth};
        p[kFoot] = {kBlock, {0.26, 0.09, 0.07}, Material::kDarkCloth};
        p[kUpperArmPart] = {kLimb, {0.05, 0.05, 0.29}, jacket};
        p[kForearmPart] = {kLimb, {0.04, 0.04, 0.29}, jacket};
    }
}

void Cyclist::place(double t, std::vector<Eigen::Isometry3d>& T_world_part) const {
    const Eigen::Isometry3d T = base(t);
    const double wheel = motion()(t)[3];
    T_world_part[kFrame] = T;
    for (const auto& [part, x] : {std::pair{kFrontWheel, 0.5 * kWheelBase_m}, {kRearWheel, -0.5 * kWheelBase_m}}) {
        T_world_part[part] =
            T * make_pose(Eigen::Quaterniond(Eigen::AngleAxisd(wheel, Vec3::UnitY())), Vec3(x, 0.0, kWheelRadius_m));
    }
    T_world_part[kTorsoPart] = T * between(kHip, kShoulder);
    T_world_part[kPelvis] = T * make_pose(Eigen::Quaterniond::Identity(), kHip);
    const Vec3 head = kShoulder + Vec3(0.1, 0.0, 0.17);
    T_world_part[kHead] = T * make_pose(Eigen::Quaterniond::Identity(), head);
    T_world_part[kHelmet] = T * make_pose(Eigen::Quaterniond::Identity(), Vec3(head + Vec3(-0.01, 0.0, 0.06)));
    for (int side = 0; side < 2; ++side) {
        const double left = side == 0 ? 1.0 : -1.0;
        Eigen::Isometry3d* part = &T_world_part[static_cast<std::size_t>(kSide + side * kSideParts)];
        const double crank = wheel / kGearRatio + (side == 0 ? 0.0 : std::numbers::pi);
        const Vec3 out(0.0, left * 0.1, 0.0);
        const Vec3 pedal = kCrankAxis + out + kCrank_m * Vec3(std::cos(crank), 0.0, -std::sin(crank));
        const Vec3 ankle = pedal + Vec3(-0.06, 0.0, 0.09);
        const Vec3 knee = joint_between(kHip + out, ankle, kThigh_m, kShin_m);
        part[kThighPart] = T * between(kHip + out, knee);
        part[kShinPart] = T * between(knee, ankle);
        part[kFoot] = T * make_pose(Eigen::Quaterniond::Identity(), Vec3(pedal + Vec3(0.03, 0.0, 0.05)));
        const Vec3 shoulder = kShoulder + Vec3(0.0, left * 0.19, -0.02);
        const Vec3 grip = kGrip + Vec3(-0.05, left * 0.26, 0.02);
        const Vec3 elbow = 0.5 * (shoulder + grip) + Vec3(-0.06, left * 0.05, -0.08);
        part[kUpperArmPart] = T * between(shoulder, elbow);
        part[kForearmPart] = T * between(elbow, grip);
    }
}

}  // namespace dlod::tools::sim
