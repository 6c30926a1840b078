#include "core/registration/normal_equations.hpp"

#include <cmath>

#include "core/types/multiversion.hpp"

namespace dlod {
namespace {

constexpr int kLanes = static_cast<int>(PlaneMatches::kLanes);
constexpr int kPairs = 21;
constexpr int kSums = 3 * kPairs + 2 * 6 + 1;

/// Each lane keeps its own sums, so that the order of additions is the same whatever the vector length.
DLOD_MULTIVERSION
void sum_lanes(const float* const* __restrict h, const float* __restrict residual, const float* __restrict weight,
               const float* __restrict time, std::size_t count, float (*__restrict sums)[kLanes]) {
    for (std::size_t i = 0; i < count; i += kLanes) {
        const float* __restrict t = time + i;
        const float* __restrict r = residual + i;
        const float* __restrict w = weight + i;
        int k = 0;
        for (int a = 0; a < 6; ++a) {
            const float* __restrict ha = h[a] + i;
            float wa[kLanes];
            for (int l = 0; l < kLanes; ++l) wa[l] = w[l] * ha[l];
            for (int b = a; b < 6; ++b, k += 3) {
                const float* __restrict hb = h[b] + i;
                float* __restrict s0 = sums[k];
                float* __restrict s1 = sums[k + 1];
                float* __restrict s2 = sums[k + 2];
                for (int l = 0; l < kLanes; ++l) {
                    const float p = wa[l] * hb[l];
                    const float pt = p * t[l];
                    s0[l] += p;
                    s1[l] += pt;
                    s2[l] += pt * t[l];
                }
            }
            float* __restrict b0 = sums[3 * kPairs + 2 * a];
            float* __restrict b1 = sums[3 * kPairs + 2 * a + 1];
            for (int l = 0; l < kLanes; ++l) {
                const float p = wa[l] * r[l];
                b0[l] += p;
                b1[l] += p * t[l];
            }
        }
        float* __restrict squares = sums[kSums - 1];
        for (int l = 0; l < kLanes; ++l) squares[l] += w[l] * r[l] * r[l];
    }
}

}  // namespace

void PlaneMatches::reserve(std::size_t n) {
    const std::size_t length = (n + kLanes - 1) / kLanes * kLanes;
    if (length <= residual.size()) return;
    for (auto& values : h) values.resize(length);
    residual.resize(length);
    weight.resize(length);
    time_s.resize(length);
    lever_m.resize(length);
    surface.resize(length);
    point.resize(length);
}

void PlaneMatches::push(const float n[3], const float l[3], float distance, float inverse_variance, float time,
                        std::uint32_t of_surface, std::uint32_t of_point) {
    h[0][count] = n[0];
    h[1][count] = n[1];
    h[2][count] = n[2];
    h[3][count] = l[1] * n[2] - l[2] * n[1];
    h[4][count] = l[2] * n[0] - l[0] * n[2];
    h[5][count] = l[0] * n[1] - l[1] * n[0];
    residual[count] = distance;
    weight[count] = inverse_variance;
    time_s[count] = time;
    lever_m[count] = std::sqrt(l[0] * l[0] + l[1] * l[1] + l[2] * l[2]);
    surface[count] = of_surface;
    point[count] = of_point;
    ++count;
}

void accumulate(PlaneMatches& matches, NormalEquations& equations) {
    const std::size_t padded = (matches.count + PlaneMatches::kLanes - 1) / PlaneMatches::kLanes * PlaneMatches::kLanes;
    for (std::size_t i = matches.count; i < padded; ++i) {
        for (auto& values : matches.h) values[i] = 0.0F;
        matches.residual[i] = matches.weight[i] = matches.time_s[i] = 0.0F;
    }
    alignas(64) float sums[kSums][kLanes] = {};
    const float* h[6];
    for (std::size_t a = 0; a < 6; ++a) h[a] = matches.h[a].data();
    sum_lanes(h, matches.residual.data(), matches.weight.data(), matches.time_s.data(), padded, sums);
    const auto total = [&](int k) {
        double sum = 0.0;
        for (const float lane : sums[k]) sum += static_cast<double>(lane);
        return sum;
    };
    int k = 0;
    for (int a = 0; a < 6; ++a) {
        for (int b = a; b < 6; ++b) {
            for (auto& A : equations.A) A(a, b) = A(b, a) = total(k++);
        }
        for (std::size_t order = 0; order < 2; ++order) {
            equations.b[order][a] = total(3 * kPairs + 2 * a + static_cast<int>(order));
        }
    }
    equations.weighted_squares = total(kSums - 1);
    equations.count = matches.count;
}

Matrix6d SurfaceInformation::of(const PlaneMatches& matches, double error_m) {
    for (std::size_t i = 0; i < matches.count; ++i) {
        if (matches.surface[i] >= weight_.size()) weight_.resize(2 * std::size_t{matches.surface[i]} + 1, 0.0F);
        weight_[matches.surface[i]] += matches.weight[i];
    }
    const auto error2 = static_cast<float>(error_m * error_m);
    float sums[kPairs] = {};
    for (std::size_t i = 0; i < matches.count; ++i) {
        const float weight = matches.weight[i] / (1.0F + error2 * weight_[matches.surface[i]]);
        float h[6];
        for (std::size_t a = 0; a < 6; ++a) h[a] = matches.h[a][i];
        for (int a = 0, k = 0; a < 6; ++a) {
            for (int b = a; b < 6; ++b) sums[k++] += weight * h[a] * h[b];
        }
    }
    for (std::size_t i = 0; i < matches.count; ++i) weight_[matches.surface[i]] = 0.0F;
    Matrix6d information;
    for (int a = 0, k = 0; a < 6; ++a) {
        for (int b = a; b < 6; ++b) information(a, b) = information(b, a) = static_cast<double>(sums[k++]);
    }
    return information;
}

}  // namespace dlod
