#include "tools/sim/ray_caster.hpp"

#include <embree3/rtcore.h>

#include <cmath>
#include <limits>
#include <stdexcept>

namespace dlod::tools::sim {
namespace {

/// Moments of a turn at which the actors' poses are set; between, Embree moves them on straight lines.
constexpr unsigned kTimeSteps = 13;

RTCScene make_scene(RTCDevice device, const Mesh& mesh) {
    RTCScene scene = rtcNewScene(device);
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* vertices = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                                                 3 * sizeof(float), mesh.vertices.size()));
    auto* indices = static_cast<std::uint32_t*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 3 * sizeof(std::uint32_t), mesh.triangles.size()));
    if (vertices == nullptr || indices == nullptr) throw std::runtime_error("Embree has no memory for the scene");
    for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
        for (int k = 0; k < 3; ++k) vertices[3 * i + static_cast<std::size_t>(k)] = mesh.vertices[i][k];
    }
    for (std::size_t i = 0; i < mesh.triangles.size(); ++i) {
        for (std::size_t k = 0; k < 3; ++k) indices[3 * i + k] = mesh.triangles[i][k];
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcCommitScene(scene);
    return scene;
}

}  // namespace

StillGeometry::StillGeometry(const World& world) : world_(world) {
    // One thread builds: the trees, and with them the outcome of ties, do not depend on the machine.
    device_ = rtcNewDevice("threads=1");
    if (device_ == nullptr) throw std::runtime_error("Embree does not work on this machine");
    still_ = make_scene(device_, world.still);
    for (const Mesh& shape : world.shapes) shapes_.push_back(make_scene(device_, shape));
}

StillGeometry::~StillGeometry() {
    for (RTCScene shape : shapes_) rtcReleaseScene(shape);
    rtcReleaseScene(still_);
    rtcReleaseDevice(device_);
}

RayCaster::RayCaster(const StillGeometry& geometry) : geometry_(geometry), scene_(rtcNewScene(geometry.device_)) {
    const auto attach = [&](RTCScene part, unsigned time_steps) {
        RTCGeometry instance = rtcNewGeometry(geometry_.device_, RTC_GEOMETRY_TYPE_INSTANCE);
        rtcSetGeometryInstancedScene(instance, part);
        rtcSetGeometryTimeStepCount(instance, time_steps);
        const Eigen::Matrix<float, 3, 4> identity = Eigen::Matrix<float, 3, 4>::Identity();
        for (unsigned step = 0; step < time_steps; ++step) {
            rtcSetGeometryTransform(instance, step, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR, identity.data());
        }
        rtcCommitGeometry(instance);
        rtcAttachGeometryByID(scene_, instance, static_cast<unsigned>(instances_.size()));
        rtcReleaseGeometry(instance);
    };
    attach(geometry.still_, 1);
    instances_.push_back({.mesh = &geometry.world_.still});
    const World& world = geometry.world_;
    for (std::size_t a = 0; a < world.actors.size(); ++a) {
        for (const Part& part : world.actors[a]->parts()) {
            const auto shape = static_cast<std::size_t>(part.shape);
            attach(geometry.shapes_[shape], kTimeSteps);
            instances_.push_back({.actor = static_cast<int>(a) + 1,
                                  .material = part.material,
                                  .mesh = part.own_materials ? &world.shapes[shape] : nullptr});
        }
    }
}

RayCaster::~RayCaster() {
    rtcReleaseScene(scene_);
}

void RayCaster::set_turn(double from_s, double to_s) {
    unsigned id = 1;
    std::vector<Eigen::Isometry3d> poses;
    for (const auto& actor : geometry_.world_.actors) {
        const std::size_t count = actor->parts().size();
        poses.resize(count);
        for (unsigned step = 0; step < kTimeSteps; ++step) {
            actor->place(from_s + (to_s - from_s) * step / (kTimeSteps - 1), poses);
            for (std::size_t i = 0; i < count; ++i) {
                Eigen::Matrix<float, 3, 4> T;
                const Eigen::Matrix3d linear = poses[i].linear() * actor->parts()[i].scale.asDiagonal();
                T.leftCols<3>() = linear.cast<float>();
                T.col(3) = poses[i].translation().cast<float>();
                const unsigned geometry_id = id + static_cast<unsigned>(i);
                rtcSetGeometryTransform(rtcGetGeometry(scene_, geometry_id), step, RTC_FORMAT_FLOAT3X4_COLUMN_MAJOR,
                                        T.data());
                if (step == kTimeSteps / 2) {
                    const Vec3 inverse = actor->parts()[i].scale.cwiseInverse();
                    instances_[geometry_id].normal_to_world =
                        Eigen::Matrix3d(poses[i].linear() * inverse.asDiagonal()).cast<float>();
                }
            }
        }
        for (std::size_t i = 0; i < count; ++i)
            rtcCommitGeometry(rtcGetGeometry(scene_, id + static_cast<unsigned>(i)));
        id += static_cast<unsigned>(count);
    }
    rtcCommitScene(scene_);
}

void RayCaster::cast(const RayBundle& rays, Hit hits[kRaysPerCast]) const {
    alignas(32) RTCRayHit8 r;
    alignas(32) int valid[kRaysPerCast];
    for (int i = 0; i < kRaysPerCast; ++i) {
        valid[i] = -1;
        r.ray.org_x[i] = rays.origin[i].x();
        r.ray.org_y[i] = rays.origin[i].y();
        r.ray.org_z[i] = rays.origin[i].z();
        r.ray.dir_x[i] = rays.direction[i].x();
        r.ray.dir_y[i] = rays.direction[i].y();
        r.ray.dir_z[i] = rays.direction[i].z();
        r.ray.tnear[i] = 0.02F;
        r.ray.tfar[i] = std::numeric_limits<float>::infinity();
        r.ray.time[i] = rays.time;
        r.ray.mask[i] = 0xFFFFFFFFU;
        r.ray.id[i] = 0;
        r.ray.flags[i] = 0;
        r.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        r.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
    }
    RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
    rtcIntersect8(valid, scene_, &context, &r);
    for (int i = 0; i < kRaysPerCast; ++i) {
        hits[i] = Hit{};
        if (r.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID) continue;
        const Instance& instance = instances_[r.hit.instID[0][i]];
        hits[i].distance_m = r.ray.tfar[i];
        hits[i].object = static_cast<std::uint16_t>(instance.actor);
        hits[i].material = instance.mesh != nullptr ? instance.mesh->materials[r.hit.primID[i]] : instance.material;
        const Eigen::Vector3f normal =
            instance.normal_to_world * Eigen::Vector3f(r.hit.Ng_x[i], r.hit.Ng_y[i], r.hit.Ng_z[i]);
        hits[i].cosine = std::abs(normal.dot(rays.direction[i])) / std::max(1e-12F, normal.norm());
    }
}

}  // namespace dlod::tools::sim
