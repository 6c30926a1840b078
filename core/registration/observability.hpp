// Which directions of the pose the matched planes determine.
//
// In a tunnel, or on an open plane, the normals' noise feigns information along the directions that nothing faces. What
// counts as evidence for a direction are therefore only matches that clearly face it.
#pragma once

#include <cmath>

#include "core/registration/normal_equations.hpp"

namespace dlod {

/// Principal directions of translation and of rotation, world axes, about which the matches say little.
class Observability {
  public:
    using Directions = Eigen::Matrix<double, 6, Eigen::Dynamic, 0, 6, 6>;

    /// Looks at matches and what they sum up to.
    /// @param demand how many times the usual number of facing matches makes a direction observable
    static Observability of(const PlaneMatches& matches, const NormalEquations& equations, double demand = 1.0);

    /// A surface whose normal has this part along a direction of translation faces it.
    static bool is_facing(float along) { return std::abs(along) > kFacingCosine; }

    /// Directions that next to no match faces: number of columns.
    int unobservable() const { return unobservable_; }
    /// Unit vectors of (translation, rotation), of which one part is zero: there the prediction must hold.
    Directions directions() const { return directions_.leftCols(unobservable_); }

    /// Along directions that only few matches face, the noise of all the others' normals outweighs what those few say:
    /// takes it out.
    void leave_facing(PlaneMatches& matches) const;
    /// There are such directions.
    bool any_weak() const { return weak_count_ > 0; }
    /// Of those few most may lie on one thing that moves, a door that opens. There the prediction is asked, too: those
    /// that it would not have expected weigh less.
    /// @param change of the pose from the prediction to where the matches' residuals have been taken
    /// @param covariance of the prediction
    void ask_prediction(PlaneMatches& matches, const Vector6d& change, const Matrix6d& covariance) const;

  private:
    static constexpr float kFacingCosine = 0.3F;

    struct Weak {
        Eigen::Vector3f direction;
        int block;  ///< first row in (translation, rotation)
    };
    Matrix6d directions_ = Matrix6d::Zero();
    int unobservable_ = 0;
    std::array<Weak, 6> weak_;  ///< observable, but by few
    int weak_count_ = 0;
};

}  // namespace dlod
