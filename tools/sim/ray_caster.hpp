// Rays against a world that moves, by Embree.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "tools/sim/world.hpp"

struct RTCDeviceTy;
struct RTCSceneTy;

namespace dlod::tools::sim {

inline constexpr int kRaysPerCast = 8;

/// Rays from one moment of a turn, in the world; a ray is a column of the arrays.
struct RayBundle {
    Eigen::Vector3f origin[kRaysPerCast];
    Eigen::Vector3f direction[kRaysPerCast];  ///< unit vectors
    float time = 0.0F;                        ///< share of the turn that has passed, 0 to 1
};

struct Hit {
    float distance_m = 0.0F;  ///< 0: nothing there
    float cosine = 0.0F;      ///< of the angle of incidence, 0 to 1
    Material material = Material::kPaving;
    std::uint16_t object = 0;  ///< 1 + index of the actor, 0: still
};

/// The parts of a world that are the same in all its turns. Shared by threads.
class StillGeometry {
  public:
    explicit StillGeometry(const World& world);
    ~StillGeometry();
    StillGeometry(const StillGeometry&) = delete;
    StillGeometry& operator=(const StillGeometry&) = delete;

  private:
    friend class RayCaster;
    const World& world_;
    RTCDeviceTy* device_;
    RTCSceneTy* still_;
    std::vector<RTCSceneTy*> shapes_;
};

/// A world during one turn; one for each thread.
class RayCaster {
  public:
    explicit RayCaster(const StillGeometry& geometry);
    ~RayCaster();
    RayCaster(const RayCaster&) = delete;
    RayCaster& operator=(const RayCaster&) = delete;

    /// Puts the actors where they are from one time to another; between, they move.
    void set_turn(double from_s, double to_s);

    void cast(const RayBundle& rays, Hit hits[kRaysPerCast]) const;

  private:
    struct Instance {
        int actor = 0;
        Material material = Material::kPlastic;
        const Mesh* mesh = nullptr;  ///< where it has materials of its own
        Eigen::Matrix3f normal_to_world = Eigen::Matrix3f::Identity();
    };
    const StillGeometry& geometry_;
    RTCSceneTy* scene_;
    std::vector<Instance> instances_;  ///< by geometry id; 0 is what stands still
};

}  // namespace dlod::tools::sim
