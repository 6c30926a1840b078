// How the sensor moved while it took one frame.
#pragma once

#include <algorithm>

namespace dlod {

/// Poses of the sensor at equidistant times up to the frame's stamp, in a frame of reference that is near the sensor,
/// so that single precision suffices. In between, the twelve numbers of a pose are interpolated linearly: knots are so
/// near to each other that this is exact to some 1e-5 rad at 5 rad/s.
struct SweepMotion {
    static constexpr int kKnots = 41;
    float rows[kKnots][12];   ///< T_local_sensor, row-major 3 x 4; the last knot is the stamp
    float duration_s = 0.1F;  ///< time from the first knot to the last

    float step_s() const { return duration_s / static_cast<float>(kKnots - 1); }
    /// Time of a knot relative to the stamp.
    float time_of(int knot) const { return static_cast<float>(knot) * step_s() - duration_s; }
    /// The last knot but one at most, the first one at least.
    int knot_before(float time_s) const {
        return std::clamp(static_cast<int>((time_s + duration_s) * (static_cast<float>(kKnots - 1) / duration_s)), 0,
                          kKnots - 2);
    }
    /// T_local_sensor at a time relative to the stamp (at most 0); before the first knot, the first knot's.
    void at(float time_s, float pose[12]) const {
        const int k = knot_before(time_s);
        const float f = std::clamp((time_s - time_of(k)) / step_s(), 0.0F, 1.0F);
        for (int i = 0; i < 12; ++i) pose[i] = rows[k][i] + f * (rows[k + 1][i] - rows[k][i]);
    }
};

}  // namespace dlod
