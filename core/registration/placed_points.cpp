#include "core/registration/placed_points.hpp"

#include <algorithm>

#include "core/types/multiversion.hpp"

namespace dlod {
namespace {

struct Arrays {
    const float *time, *x, *y, *z, *nx, *ny, *nz, *tx, *ty, *tz;
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
    const float* __restrict tx = a.tx;
    const float* __restrict ty = a.ty;
    const float* __restrict tz = a.tz;
    float* __restrict px = a.px;
    float* __restrict py = a.py;
    float* __restrict pz = a.pz;
    float* __restrict lx = a.lx;
    float* __restrict ly = a.ly;
    float* __restrict lz = a.lz;
    float* __restrict ox = a.ox;
    float* __restrict oy = a.oy;
    float* __restrict oz = a.oz;
#pragma GCC ivdep
    for (std::size_t i = begin; i < end; ++i) {
        const float raw = (time[i] - start) * inverse_step;
        const float f = raw < 0.0F ? 0.0F : raw > 1.0F ? 1.0F : raw;
        float lever[3], position[3], normal[3], gradient[3], velocity[3];
        for (int row = 0; row < 3; ++row) {
            const float* pose = first + 4 * row;
            const float* rate = change + 4 * row;
            const float t0 = pose[0] + f * rate[0];
            const float t1 = pose[1] + f * rate[1];
            const float t2 = pose[2] + f * rate[2];
            lever[row] = t0 * x[i] + t1 * y[i] + t2 * z[i];
            position[row] = lever[row] + (pose[3] + f * rate[3]);
            normal[row] = t0 * nx[i] + t1 * ny[i] + t2 * nz[i];
            gradient[row] = t0 * tx[i] + t1 * ty[i] + t2 * tz[i];
            velocity[row] = inverse_step * (rate[0] * x[i] + rate[1] * y[i] + rate[2] * z[i] + rate[3]);
        }
        // The window has been moved by R p + velocity * (gradient . p): normals follow by the inverse transpose.
        const float approach = velocity[0] * normal[0] + velocity[1] * normal[1] + velocity[2] * normal[2];
        const float stretch = velocity[0] * gradient[0] + velocity[1] * gradient[1] + velocity[2] * gradient[2];
        const float shear = approach / (1.0F + stretch);
        for (int row = 0; row < 3; ++row) normal[row] -= shear * gradient[row];
        // Of length 1 again, by one step of Newton's method; no normal stays none.
        const float length2 = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
        const float scale = 1.5F - 0.5F * length2;
        px[i] = position[0];
        py[i] = position[1];
        pz[i] = position[2];
        lx[i] = lever[0];
        ly[i] = lever[1];
        lz[i] = lever[2];
        ox[i] = scale * normal[0];
        oy[i] = scale * normal[1];
        oz[i] = scale * normal[2];
    }
}

}  // namespace

void place(const PointSelection& points, std::size_t count, const SweepMotion& motion, PlacedPoints& placed) {
    for (auto* v :
         {&placed.x, &placed.y, &placed.z, &placed.lx, &placed.ly, &placed.lz, &placed.nx, &placed.ny, &placed.nz}) {
        v->reserve(points.pixel.capacity());
        v->resize(points.size());
    }
    const Arrays arrays{points.time_s.data(), points.x.data(),  points.y.data(),  points.z.data(),  points.nx.data(),
                        points.ny.data(),     points.nz.data(), points.tx.data(), points.ty.data(), points.tz.data(),
                        placed.x.data(),      placed.y.data(),  placed.z.data(),  placed.lx.data(), placed.ly.data(),
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
