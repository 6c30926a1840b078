#include "core/registration/placed_points.hpp"

#include <algorithm>

#include "core/types/multiversion.hpp"

namespace dlod {
namespace {

struct Arrays {
    const float *time, *x, *y, *z, *nx, *ny, *nz;
    float *px, *py, *pz, *lx, *ly, *lz, *ox, *oy, *oz;
};

/// Points of one interval between knots: the pose is first + f * change.
DLOD_MULTIVERSION
void place_run(const float* __restrict first, const float* __restrict change, float start, float inverse_step,
               const Arrays& a, std::size_t begin, std::size_t end) {
    const float* __restrict time = a.time;
    const float* __restrict x = a.x;
    const float* __restrict y = a.y;
    const float* __restrict z = a.z;
    const float* __restrict nx = a.nx;
    const float* __restrict ny = a.ny;
    const float* __restrict nz = a.nz;
    float* const lever[3] = {a.lx, a.ly, a.lz};
    float* const position[3] = {a.px, a.py, a.pz};
    float* const normal[3] = {a.ox, a.oy, a.oz};
    for (int row = 0; row < 3; ++row) {
        const float a0 = first[4 * row], a1 = first[4 * row + 1], a2 = first[4 * row + 2], a3 = first[4 * row + 3];
        const float b0 = change[4 * row], b1 = change[4 * row + 1], b2 = change[4 * row + 2], b3 = change[4 * row + 3];
        float* __restrict l = lever[row];
        float* __restrict p = position[row];
        float* __restrict n = normal[row];
        for (std::size_t i = begin; i < end; ++i) {
            const float raw = (time[i] - start) * inverse_step;
            const float f = raw < 0.0F ? 0.0F : raw > 1.0F ? 1.0F : raw;
            const float t0 = a0 + f * b0;
            const float t1 = a1 + f * b1;
            const float t2 = a2 + f * b2;
            l[i] = t0 * x[i] + t1 * y[i] + t2 * z[i];
            p[i] = l[i] + (a3 + f * b3);
            n[i] = t0 * nx[i] + t1 * ny[i] + t2 * nz[i];
        }
    }
}

}  // namespace

void place(const PointSelection& points, std::size_t count, const SweepMotion& motion, PlacedPoints& placed) {
    for (auto* v :
         {&placed.x, &placed.y, &placed.z, &placed.lx, &placed.ly, &placed.lz, &placed.nx, &placed.ny, &placed.nz}) {
        v->reserve(points.pixel.capacity());
        v->resize(points.size());
    }
    const Arrays arrays{points.time_s.data(), points.x.data(),  points.y.data(),  points.z.data(),
                        points.nx.data(),     points.ny.data(), points.nz.data(), placed.x.data(),
                        placed.y.data(),      placed.z.data(),  placed.lx.data(), placed.ly.data(),
                        placed.lz.data(),     placed.nx.data(), placed.ny.data(), placed.nz.data()};
    for (std::size_t begin = 0; begin < count;) {
        const int knot = motion.knot_before(points.time_s[begin]);
        std::size_t end = begin + 1;
        while (end < count && motion.knot_before(points.time_s[end]) == knot) ++end;
        float change[12];
        for (int i = 0; i < 12; ++i) change[i] = motion.rows[knot + 1][i] - motion.rows[knot][i];
        place_run(motion.rows[knot], change, motion.time_of(knot), 1.0F / motion.step_s(), arrays, begin, end);
        begin = end;
    }
}

}  // namespace dlod
