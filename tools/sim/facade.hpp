// Buildings with relief: recessed windows and doors, pillars, ledges, balconies.
#pragma once

#include "tools/sim/mesh.hpp"
#include "tools/sim/random.hpp"

namespace dlod::tools::sim {

struct FacadeStyle {
    double floor_m = 3.3;
    int floors = 4;
    double bay_m = 3.0;     ///< width of a window's share of the wall
    double window_m = 1.3;  ///< width
    double window_height_m = 1.7;
    double recess_m = 0.2;   ///< depth of the windows
    bool pillars = false;    ///< between the bays
    bool ledges = true;      ///< between the floors
    double balconies = 0.0;  ///< share of the windows that have one
    double blinds = 0.25;    ///< share of the windows that are closed
    Material wall = Material::kPlaster;
};

FacadeStyle random_style(Random& random);

/// A wall from a to b; the outside is to the right of that direction. `z`: where it stands.
void add_facade(Mesh& mesh, Random& random, const Vec2& a, const Vec2& b, double z, const FacadeStyle& style);

/// A house: a facade from a to b as above, its sides `depth_m` back, a pitched roof.
void add_house(Mesh& mesh, Random& random, const Vec2& a, const Vec2& b, double z, double depth_m,
               const FacadeStyle& style);

}  // namespace dlod::tools::sim
