// A point of the scan moved into the local frame of the registration.
#pragma once

namespace dlod {

struct PlacedPoint {
    float position[3];  ///< local frame
    float lever[3];     ///< from the sensor to the point, local axes
};

/// Applies T_local_sensor, row-major 3 x 4.
inline PlacedPoint place(const float T[12], float x, float y, float z) {
    PlacedPoint p;
    for (int i = 0; i < 3; ++i) {
        p.lever[i] = T[4 * i] * x + T[4 * i + 1] * y + T[4 * i + 2] * z;
        p.position[i] = p.lever[i] + T[4 * i + 3];
    }
    return p;
}

inline float dot(const float a[3], const float b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

}  // namespace dlod
