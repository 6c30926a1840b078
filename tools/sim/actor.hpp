// Things that move, or may: rigid parts hung on a motion over the ground.
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <string>
#include <vector>

#include "core/types/oriented_box.hpp"
#include "tools/sim/mesh.hpp"
#include "tools/sim/spline.hpp"

namespace dlod::tools::sim {

/// Height of the ground at x, y; metres.
using Terrain = std::function<double(double, double)>;

/// x [m], y [m], heading [rad, not wrapped], and the phase of what repeats with the distance (gait, wheels) [rad].
using Motion = Spline<4>;

/// Shapes that all scenes share; a scene adds its own behind them.
enum SharedShape : int {
    kBall,   ///< radius 1 about the origin
    kLimb,   ///< from the origin to z = 1, radius 1, thinner to its end
    kTorso,  ///< from the origin (waist) to z = 1 (neck), radius 1
    kBlock,  ///< edge 1 about the origin
    kSharedShapes,
};

/// The meshes of SharedShape, in its order.
std::vector<Mesh> shared_shapes();

/// A rigid part: a shape, stretched, of one material or of the mesh's own.
struct Part {
    int shape = kBlock;
    Vec3 scale = Vec3::Ones();
    Material material = Material::kMediumCloth;
    bool own_materials = false;  ///< the mesh's own materials count
};

class Actor {
  public:
    Actor(std::string kind, Motion motion, Terrain terrain);
    virtual ~Actor() = default;
    Actor(const Actor&) = delete;
    Actor& operator=(const Actor&) = delete;

    /// Class in objects.csv, such as person.
    const std::string& kind() const { return kind_; }
    const std::vector<Part>& parts() const { return parts_; }
    const Motion& motion() const { return motion_; }

    /// Poses of the parts in the world, before their scale; [parts].
    virtual void place(double t, std::vector<Eigen::Isometry3d>& T_world_part) const = 0;

    /// Speed of what makes it a moving object, m/s.
    virtual double speed(double t) const;

    /// On the ground below its middle, x along its heading.
    Eigen::Isometry3d base(double t) const;

    /// Box around all its parts at a time, along its heading.
    OrientedBox bounds(double t, const std::vector<Mesh>& shapes) const;

  protected:
    double ground(double x, double y) const { return terrain_(x, y); }

    std::vector<Part> parts_;

  private:
    std::string kind_;
    Motion motion_;
    Terrain terrain_;
};

}  // namespace dlod::tools::sim
