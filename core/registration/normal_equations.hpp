// Normal equations of a registration whose points were fired at different times.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/types/image.hpp"
#include "core/types/lie.hpp"

namespace dlod {

/// Linearised point-to-plane distances, structure of arrays. With a point's position q in the world, fired dt before
/// the stamp from a sensor at s, its distance to a plane of normal n depends on the state's errors as
///     residual + h . (dp + dt dv, dtheta + dt domega),   h = (n, (q - s) x n).
struct PlaneMatches {
    static constexpr std::size_t kLanes = 8;
    std::array<AlignedVector<float>, 6> h;
    AlignedVector<float> residual, weight, time_s;
    AlignedVector<float> lever_m;          ///< |q - s|
    AlignedVector<std::uint32_t> surface;  ///< equal for matches with the same plane
    AlignedVector<std::uint32_t> point;    ///< number of the point in its scan
    std::size_t count = 0;
    std::size_t flat = 0;  ///< of them the first so many: those of points whose normal is known

    /// Makes room for n matches.
    void reserve(std::size_t n);
    void clear() { count = flat = 0; }
    void push(const float normal[3], const float lever[3], float distance, float inverse_variance, float time,
              std::uint32_t of_surface, std::uint32_t of_point);
};

/// Sums of weight h h^T dt^k and weight h residual dt^k.
struct NormalEquations {
    std::array<Matrix6d, 3> A;
    std::array<Vector6d, 2> b;
    double weighted_squares = 0.0;  ///< sum of weight residual^2
    std::size_t count = 0;
};

/// What the matches say of the pose at the stamp when all those with one plane share an error of this deviation, beside
/// their own: however many points lie on a surface, they tell of it no better than the map knows it.
class SurfaceInformation {
  public:
    /// sum over the surfaces of sum(weight h h^T) / (1 + error_m^2 sum(weight))
    Matrix6d of(const PlaneMatches& matches, double error_m);

  private:
    std::vector<float> weight_;  ///< scratch, by surface: 0 for all outside of a call
};

/// Sums up all matches. Pads the last lanes with matches of weight 0.
void accumulate(PlaneMatches& matches, NormalEquations& equations);

}  // namespace dlod
