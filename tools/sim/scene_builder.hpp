// Tools that all scenes are built with.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "tools/sim/crowd.hpp"
#include "tools/sim/facade.hpp"
#include "tools/sim/props.hpp"
#include "tools/sim/traffic.hpp"
#include "tools/sim/world.hpp"

namespace dlod::tools::sim {

struct Rectangle {
    Vec2 low = Vec2::Zero();
    Vec2 high = Vec2::Zero();
};

class SceneBuilder {
  public:
    enum class Kind { kPerson, kDog, kCyclist };

    SceneBuilder(const SceneOptions& options, std::uint64_t stream);

    const SceneOptions& options() const { return options_; }
    Random& random() { return random_; }
    Mesh& mesh() { return world_.still; }
    std::vector<Obstacle>& obstacles() { return obstacles_; }
    Stage stage() { return {world_.still, obstacles_, random_}; }

    /// Terrain first: everything else stands on it.
    void set_terrain(Terrain terrain) { terrain_ = std::move(terrain); }
    Vec3 on_ground(const Vec2& p) const { return {p.x(), p.y(), terrain_(p.x(), p.y())}; }
    /// Ground as a grid; `cell_m` fine enough for the terrain.
    void add_ground(const Rectangle& area, double cell_m, Material material);
    /// The upright face of a step in the ground between two points; the terrain is taken a little to either side.
    void add_kerb(const Vec2& a, const Vec2& b);

    /// The robot's way; props keep clear of it.
    void set_path(const ArcPath& path) { path_ = path; }
    const ArcPath& path() const { return path_; }

    /// A place in the area with `clear_m` to obstacles and `path_m` to the robot's way; the last try if there is none.
    Vec2 free_place(const Rectangle& area, double clear_m, double path_m);
    bool is_free(const Vec2& p, double clear_m, double path_m) const;

    /// Index for leaders. `stride_m` of the walker is filled in.
    int add_walker(Kind kind, Walker walker);
    /// Somebody who walks between places drawn from the area.
    int add_wanderer(Kind kind, const Rectangle& area, double speed_mps, double pause_share);
    /// People who walk to and fro near the robot's way, at a distance from it between two limits.
    void add_passers(int count, double near_m, double far_m);
    /// People who stand and walk around the start of the robot's way.
    void add_crowd(int count);
    /// Vehicles of a lane, from the foremost to the last; `kind` is car, van or bus.
    void add_lane(const ArcPath& lane, const std::vector<std::pair<std::string, Driver>>& vehicles,
                  const std::vector<StopLine>& stops);
    void add_actor(std::unique_ptr<Actor> actor) { world_.actors.push_back(std::move(actor)); }
    int add_shape(Mesh mesh);
    const Terrain& terrain() const { return terrain_; }

    /// Plans the robot's motion, walks the crowd, hands out the world.
    World finish();

  private:
    SceneOptions options_;
    Random random_;
    World world_;
    Terrain terrain_ = [](double, double) { return 0.0; };
    ArcPath path_;
    std::vector<Obstacle> obstacles_;
    std::vector<Walker> walkers_;
    std::vector<Kind> kinds_;
    int bicycle_frame_ = -1;
    int bicycle_wheel_ = -1;
};

}  // namespace dlod::tools::sim
