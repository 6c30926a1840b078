// Things that stand around: each adds its triangles and what to walk around.
#pragma once

#include <vector>

#include "tools/sim/mesh.hpp"
#include "tools/sim/obstacle.hpp"
#include "tools/sim/random.hpp"

namespace dlod::tools::sim {

/// Where props go.
struct Stage {
    Mesh& mesh;
    std::vector<Obstacle>& obstacles;
    Random& random;
};

/// `base`: on the ground below the prop's middle.
void add_tree(Stage stage, const Vec3& base);
void add_bush(Stage stage, const Vec3& base, double radius_m);
void add_hedge(Stage stage, const Vec3& from, const Vec3& to, double height_m);
void add_bench(Stage stage, const Vec3& base, double yaw_rad);
void add_lamp_post(Stage stage, const Vec3& base);
void add_bollard(Stage stage, const Vec3& base);
void add_bin(Stage stage, const Vec3& base);
void add_planter(Stage stage, const Vec3& base, double yaw_rad);
void add_fountain(Stage stage, const Vec3& base);
void add_kiosk(Stage stage, const Vec3& base, double yaw_rad);
void add_cafe_table(Stage stage, const Vec3& base, bool umbrella);
void add_sign(Stage stage, const Vec3& base, double yaw_rad);
void add_traffic_light(Stage stage, const Vec3& base, double yaw_rad);
void add_parked_bicycle(Stage stage, const Vec3& base, double yaw_rad);
void add_parked_car(Stage stage, const Vec3& base, double yaw_rad);
void add_statue(Stage stage, const Vec3& base);
// Indoors.
void add_desk_and_chair(Stage stage, const Vec3& base, double yaw_rad);
void add_cabinet(Stage stage, const Vec3& base, double yaw_rad);
void add_plant(Stage stage, const Vec3& base);
void add_sofa(Stage stage, const Vec3& base, double yaw_rad);
void add_boxes(Stage stage, const Vec3& base);

/// Leaves that fill an ellipsoid, as triangles turned at random.
void add_leaves(Mesh& mesh, Random& random, const Vec3& center, const Vec3& radii_m, int count, double size_m);

}  // namespace dlod::tools::sim
