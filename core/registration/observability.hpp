// Which directions of the pose the matched planes determine.
//
// In a tunnel, or on an open plane, the normals' noise feigns information along the directions that nothing faces. What
// counts as evidence for a direction are therefore only matches that clearly face it.
#pragma once

#include "core/registration/normal_equations.hpp"

namespace dlod {

struct Observability {
    Matrix6d projector = Matrix6d::Identity();  ///< onto the observable directions of (translation, rotation)
    int unobservable = 0;                       ///< number of directions that are not
};

/// Looks at the principal directions of translation and of rotation.
Observability observe(const PlaneMatches& matches, const NormalEquations& equations);

/// Removes what the matches seem to say about unobservable directions: there the prediction holds.
void project(const Observability& observability, NormalEquations& equations);

}  // namespace dlod
