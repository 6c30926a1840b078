#include "core/preprocess/subsampling.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace dlod {
namespace {

// Weight of a raw point against a smoothed one of a perfect plane.
constexpr float kRawPlanarity = 0.1F;

/// Face of a cube that the direction points through, in quarters.
std::uint8_t direction_bin(const Eigen::Vector3f& n) {
    Eigen::Index axis;
    n.cwiseAbs().maxCoeff(&axis);
    const int sign = n[axis] > 0.0F ? 1 : 0;
    const int u = n[(axis + 1) % 3] > 0.0F ? 1 : 0;
    const int v = n[(axis + 2) % 3] > 0.0F ? 1 : 0;
    return static_cast<std::uint8_t>(((static_cast<int>(axis) * 2 + sign) * 2 + u) * 2 + v);
}

/// The largest share per bin at which all bins together stay within the budget; bins with less keep all they have.
template <std::size_t N>
int fair_share(const std::array<int, N>& counts, int budget) {
    std::array<int, N> sorted = counts;
    std::sort(sorted.begin(), sorted.end());
    int left = budget;
    for (std::size_t i = 0; i < N; ++i) {
        const int share = left / static_cast<int>(N - i);
        if (sorted[i] > share) return std::max(1, share);
        left -= sorted[i];
    }
    return budget;
}

}  // namespace

Subsampling::Subsampling(const SensorModel& sensor, const SubsamplingConfig& config)
    : sensor_(sensor), config_(config), windows_(sensor, std::clamp(config.column_step, 1, sensor.width)) {
    const int rows = std::clamp(config.rows, 1, sensor.height);
    for (int i = 0; i < rows; ++i) candidate_rows_.push_back((2 * i + 1) * sensor.height / (2 * rows));
    const auto most = static_cast<std::size_t>(rows) * static_cast<std::size_t>(windows_.windows());
    flat_.reserve(most);
    rough_.reserve(most);
    order_.reserve(most);
    next_.reserve(static_cast<std::size_t>(sensor.width) + 1);
}

void Subsampling::process(Frame& frame) {
    flat_.clear();
    rough_.clear();
    windows_.load(frame);
    for (const int row : candidate_rows_) collect_row(frame, row);
    select(frame);
}

void Subsampling::collect_row(const Frame& frame, int row) {
    windows_.fit_row(row, planes_);
    const int w = sensor_.width;
    const auto min_range = static_cast<float>(std::max(config_.min_range_m, 1e-3));
    const auto crop = static_cast<float>(config_.crop_box_m);
    const auto max_deviation = static_cast<float>(config_.max_deviation_m);
    const auto min_incidence = static_cast<float>(config_.min_incidence);
    // Columns per spacing at one metre of range.
    const auto columns_at_1m = static_cast<float>(config_.spacing_m * w / (2.0 * std::numbers::pi));
    const float* range = frame.cloud.range_m.row(row);
    const std::uint32_t* raw = frame.raw.range_mm.row(row);
    const float* x = frame.cloud.x.row(row);
    const float* y = frame.cloud.y.row(row);
    const float* z = frame.cloud.z.row(row);
    const int first = row * w;
    for (int k = 0; k < windows_.windows(); ++k) {
        const int c = k * config_.column_step;
        if (range[c] < min_range) continue;
        if (std::max({std::abs(x[c]), std::abs(y[c]), std::abs(z[c])}) < crop) continue;
        const auto i = static_cast<std::size_t>(k);
        const float inverse = planes_.inverse_range[i];
        if (inverse > 0.0F && planes_.deviation_m[i] <= max_deviation) {
            // Power of two, so that the thinned grid of neighbouring ranges shares its columns.
            int step = 1;
            while (static_cast<float>(2 * step * config_.column_step) <= columns_at_1m * inverse) step *= 2;
            if (k % step != 0) continue;
            const float b = planes_.slope_azimuth[i];
            const float g = planes_.slope_altitude[i];
            const float length = std::sqrt(inverse * inverse + b * b + g * g);
            if (inverse >= min_incidence * length) {
                const BeamFrame beam = windows_.beam(row, c);
                const Eigen::Vector3f normal = -(inverse * beam.direction + b * beam.along_row + g * beam.up) / length;
                const float ratio = planes_.deviation_m[i] / max_deviation;
                flat_.push_back({static_cast<PixelIndex>(first + c), direction_bin(normal),
                                 1.0F / inverse - windows_.distance(raw[c]), 1.0F - 0.9F * ratio * ratio, normal.x(),
                                 normal.y(), normal.z()});
                continue;
            }
        }
        if (k % config_.rough_step == 0) rough_.push_back(static_cast<PixelIndex>(first + c));
    }
}

int Subsampling::measurement_of(PixelIndex pixel) const {
    return sensor_.measurement_of(static_cast<int>(pixel) / sensor_.width, static_cast<int>(pixel) % sensor_.width);
}

/// Counting sort of 0 .. count - 1 into order_.
template <class Measurement>
void Subsampling::sort_by_measurement(std::size_t count, Measurement&& measurement) {
    next_.assign(static_cast<std::size_t>(sensor_.width) + 1, 0);
    for (std::size_t i = 0; i < count; ++i) ++next_[static_cast<std::size_t>(measurement(i)) + 1];
    for (std::size_t m = 1; m < next_.size(); ++m) next_[m] += next_[m - 1];
    order_.resize(count);
    for (std::size_t i = 0; i < count; ++i)
        order_[next_[static_cast<std::size_t>(measurement(i))]++] = static_cast<std::uint32_t>(i);
}

void Subsampling::select(Frame& frame) {
    PointSelection& points = frame.prepared.points;
    points.clear();
    const auto append = [&](PixelIndex pixel, const Eigen::Vector3f& normal, float planarity, float smoothing_m) {
        const auto m = static_cast<std::size_t>(measurement_of(pixel));
        Eigen::Vector3f p(frame.cloud.x[pixel], frame.cloud.y[pixel], frame.cloud.z[pixel]);
        if (smoothing_m != 0.0F)
            p += smoothing_m *
                 windows_.beam(static_cast<int>(pixel) / sensor_.width, static_cast<int>(pixel) % sensor_.width)
                     .direction;
        points.pixel.push_back(pixel);
        points.measurement.push_back(static_cast<std::uint16_t>(m));
        points.x.push_back(p.x());
        points.y.push_back(p.y());
        points.z.push_back(p.z());
        points.nx.push_back(normal.x());
        points.ny.push_back(normal.y());
        points.nz.push_back(normal.z());
        points.planarity.push_back(planarity);
        points.time_s.push_back(static_cast<float>(frame.columns.time_ns[m] - frame.header.stamp_ns) * 1e-9F);
    };
    std::array<int, kDirections> count{};
    for (const Candidate& candidate : flat_) ++count[candidate.direction];
    const int share = fair_share(count, config_.points);
    // Every count/share-th of a bin, spread evenly over the image.
    std::array<int, kDirections> credit{};
    std::erase_if(flat_, [&](const Candidate& candidate) {
        int& c = credit[candidate.direction];
        c += std::min(share, count[candidate.direction]);
        if (c < count[candidate.direction]) return true;
        c -= count[candidate.direction];
        return false;
    });
    // In the order of their firing, so that neighbours share their place in the sweep.
    sort_by_measurement(flat_.size(), [&](std::size_t i) { return measurement_of(flat_[i].pixel); });
    for (const std::uint32_t i : order_) {
        const Candidate& c = flat_[i];
        append(c.pixel, {c.nx, c.ny, c.nz}, c.planarity, c.smoothing_m);
    }
    sort_by_measurement(rough_.size(), [&](std::size_t i) { return measurement_of(rough_[i]); });
    const int available = static_cast<int>(rough_.size());
    const int wanted = std::clamp(config_.least_points - static_cast<int>(flat_.size()), 0, available);
    int raw_credit = 0;
    for (const std::uint32_t i : order_) {
        raw_credit += wanted;
        const bool takes_part = raw_credit >= available && wanted > 0;
        if (takes_part) raw_credit -= available;
        append(rough_[i], Eigen::Vector3f::Zero(), takes_part ? kRawPlanarity : 0.0F, 0.0F);
    }
}

}  // namespace dlod
