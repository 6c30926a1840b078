#include "core/odometry/deskew.hpp"

#include <algorithm>

#include "core/types/multiversion.hpp"

namespace dlod {
namespace {

// Columns whose transforms stay in the first-level cache while all rows pass by.
constexpr int kTile = 256;

/// out = D * (x, y, z), 0 where nothing was returned; D varies with the column.
DLOD_MULTIVERSION
void deskew_run(const float* const* __restrict d, int first, const float* __restrict x, const float* __restrict y,
                const float* __restrict z, float* __restrict ox, float* __restrict oy, float* __restrict oz,
                int count) {
    const float* __restrict d0 = d[0] + first;
    const float* __restrict d1 = d[1] + first;
    const float* __restrict d2 = d[2] + first;
    const float* __restrict d3 = d[3] + first;
    const float* __restrict d4 = d[4] + first;
    const float* __restrict d5 = d[5] + first;
    const float* __restrict d6 = d[6] + first;
    const float* __restrict d7 = d[7] + first;
    const float* __restrict d8 = d[8] + first;
    const float* __restrict d9 = d[9] + first;
    const float* __restrict d10 = d[10] + first;
    const float* __restrict d11 = d[11] + first;
    for (int i = 0; i < count; ++i) {
        const float there = x[i] * x[i] + y[i] * y[i] + z[i] * z[i] > 0.0F ? 1.0F : 0.0F;
        ox[i] = d0[i] * x[i] + d1[i] * y[i] + d2[i] * z[i] + there * d3[i];
        oy[i] = d4[i] * x[i] + d5[i] * y[i] + d6[i] * z[i] + there * d7[i];
        oz[i] = d8[i] * x[i] + d9[i] * y[i] + d10[i] * z[i] + there * d11[i];
    }
}

}  // namespace

void deskew(const SensorModel& sensor, const SweepMotion& motion, Frame& frame) {
    const int w = sensor.width;
    OdometryResult& out = frame.odometry;
    // T_stamp_column = T_local_stamp^-1 T_local_column
    const float* last = motion.rows[SweepMotion::kKnots - 1];
    for (int m = 0; m < w; ++m) {
        const auto column = static_cast<std::size_t>(m);
        float T[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
        if (frame.columns.valid[column]) {
            float L[12];
            motion.at(static_cast<float>(frame.columns.time_ns[column] - frame.header.stamp_ns) * 1e-9F, L);
            for (int i = 0; i < 3; ++i) L[4 * i + 3] -= last[4 * i + 3];
            for (int i = 0; i < 3; ++i) {
                for (int j = 0; j < 4; ++j)
                    T[4 * i + j] = last[i] * L[j] + last[4 + i] * L[4 + j] + last[8 + i] * L[8 + j];
            }
        }
        for (std::size_t k = 0; k < 12; ++k) out.deskew[k][column] = T[k];
    }
    const float* rows[12];
    for (std::size_t k = 0; k < 12; ++k) rows[k] = out.deskew[k].data();
    for (int first = 0; first < w; first += kTile) {
        const int end = std::min(w, first + kTile);
        for (int r = 0; r < sensor.height; ++r) {
            const int shift = ((sensor.pixel_shift[static_cast<std::size_t>(r)] % w) + w) % w;
            // The measurements [begin, past), whose columns follow each other up to the image's edge.
            const auto run = [&](int begin, int past, int column) {
                deskew_run(rows, begin, frame.cloud.x.row(r) + column, frame.cloud.y.row(r) + column,
                           frame.cloud.z.row(r) + column, out.x.row(r) + column, out.y.row(r) + column,
                           out.z.row(r) + column, past - begin);
            };
            const int edge = std::clamp(w - shift, first, end);
            if (edge > first) run(first, edge, first + shift);
            if (end > edge) run(edge, end, edge + shift - w);
        }
    }
}

}  // namespace dlod
