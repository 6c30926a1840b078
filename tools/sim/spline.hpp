// Motion as smooth curves over time.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <vector>

namespace dlod::tools::sim {

/// Uniform cubic B-spline with N channels over time: twice continuously differentiable, so that an IMU can ride on it.
template <int N>
class Spline {
  public:
    using Value = Eigen::Matrix<double, N, 1>;

    Spline() = default;
    /// `knots` apply at start, start + step, ...; the curve passes near, not through them. Holds its ends.
    Spline(double start_s, double step_s, std::vector<Value> knots)
        : start_s_(start_s), step_s_(step_s), knots_(std::move(knots)) {}

    Value operator()(double t) const {
        const double u = (t - start_s_) / step_s_;
        const double whole = std::floor(u);
        const double f = u - whole;
        const auto i = static_cast<std::ptrdiff_t>(std::clamp(whole, -1e9, 1e9));
        const double g = 1.0 - f;
        return (g * g * g * knot(i - 1) + (3.0 * f * f * (f - 2.0) + 4.0) * knot(i) +
                (3.0 * g * g * (g - 2.0) + 4.0) * knot(i + 1) + f * f * f * knot(i + 2)) /
               6.0;
    }

    Value derivative(double t) const {
        constexpr double kHalfStep_s = 1e-3;
        return ((*this)(t + kHalfStep_s) - (*this)(t - kHalfStep_s)) / (2.0 * kHalfStep_s);
    }

  private:
    const Value& knot(std::ptrdiff_t i) const {
        const auto last = static_cast<std::ptrdiff_t>(knots_.size()) - 1;
        return knots_[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(i, 0, last))];
    }

    double start_s_ = 0.0;
    double step_s_ = 1.0;
    std::vector<Value> knots_;
};

/// Gaussian low pass over samples, the ends held.
template <class Value>
std::vector<Value> smoothed(const std::vector<Value>& samples, double sigma_samples) {
    const int reach = static_cast<int>(std::ceil(3.0 * sigma_samples));
    std::vector<double> weight;
    double sum = 0.0;
    for (int k = -reach; k <= reach; ++k) {
        weight.push_back(std::exp(-0.5 * k * k / (sigma_samples * sigma_samples)));
        sum += weight.back();
    }
    std::vector<Value> result(samples.size());
    const auto last = static_cast<int>(samples.size()) - 1;
    for (int i = 0; i <= last; ++i) {
        Value total = samples[0] * 0.0;
        for (int k = -reach; k <= reach; ++k) {
            total += samples[static_cast<std::size_t>(std::clamp(i + k, 0, last))] *
                     (weight[static_cast<std::size_t>(k + reach)] / sum);
        }
        result[static_cast<std::size_t>(i)] = total;
    }
    return result;
}

}  // namespace dlod::tools::sim
