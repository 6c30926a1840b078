#include "core/preprocess/subsampling.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace dlod {
namespace {

// Weight of a raw point against a smoothed one of a perfect plane.
constexpr float kRawPlanarity = 0.1F;

// Of images with more columns so many more are skipped: what counts is the angle between candidates.
constexpr int kColumns = 1024;

SubsamplingConfig scaled(SubsamplingConfig config, int width) {
    config.column_step = std::clamp(config.column_step * std::max(1, width / kColumns), 1, width);
    return config;
}

/// Face of a cube that a direction of any length points through, in quarters.
std::uint8_t direction_bin(const std::array<float, 3>& n) {
    const float x = std::abs(n[0]), y = std::abs(n[1]), z = std::abs(n[2]);
    const unsigned axis = x >= y && x >= z ? 0 : y >= z ? 1 : 2;
    const unsigned signs = (n[0] > 0.0F ? 1U : 0U) | (n[1] > 0.0F ? 2U : 0U) | (n[2] > 0.0F ? 4U : 0U);
    return static_cast<std::uint8_t>(8U * axis + signs);
}

/// Takes `wanted` of `count` evenly: true for those that are taken.
bool is_next(int wanted, int count, int& credit) {
    credit += std::min(wanted, count);
    if (credit < count) return false;
    credit -= count;
    return true;
}

/// Of the stamp, seconds.
float time_of(const Frame& frame, std::uint16_t measurement) {
    return static_cast<float>(frame.columns.time_ns[measurement] - frame.header.stamp_ns) * 1e-9F;
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
    : sensor_(sensor),
      config_(scaled(config, sensor.width)),
      windows_(sensor, config_.column_step),
      rows_(std::clamp(config.rows, 1, sensor.height)) {
    const int after_first = sensor.column_window_last - sensor.column_window_first;
    sent_columns_ = (after_first + sensor.width) % sensor.width + 1;
    const auto most = static_cast<std::size_t>(rows_) * static_cast<std::size_t>(windows_.windows());
    flat_.reserve(most);
    rough_.reserve(most);
    partial_.reserve(most);
    order_.reserve(most);
    next_.reserve(static_cast<std::size_t>(sensor.width) + 1);
}

void Subsampling::process(Frame& frame) {
    flat_.clear();
    rough_.clear();
    partial_.clear();
    windows_.load(frame);
    const int rows = rows_of(frame);
    for (int i = 0; i < rows; ++i) collect_row(frame, (2 * i + 1) * sensor_.height / (2 * rows));
    select(frame);
}

/// Rows with candidates: so many that there are as many candidates as in a whole frame. With beams of different
/// azimuths other rows have lost other columns.
int Subsampling::rows_of(const Frame& frame) const {
    const int came = std::clamp(frame.header.valid_columns, 1, sent_columns_);
    return std::min(rows_ * sent_columns_ / came, sensor_.height);
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
    const WindowFiring& whole = windows_.firing(row);
    const int whole_delay = static_cast<int>(std::lround(whole.time.centre));
    auto partial = planes_.partial.cbegin();
    const float* range = frame.cloud.range_m.row(row);
    const float* x = frame.cloud.x.row(row);
    const float* y = frame.cloud.y.row(row);
    const float* z = frame.cloud.z.row(row);
    const int first = row * w;
    int measurement = sensor_.measurement_of(row, 0) - config_.column_step;
    for (int k = 0; k < windows_.windows(); ++k) {
        const int c = k * config_.column_step;
        measurement += config_.column_step;
        if (measurement >= w) measurement -= w;
        if (range[c] < min_range) continue;
        if (std::abs(x[c]) < crop && std::abs(y[c]) < crop && std::abs(z[c]) < crop) continue;
        const auto i = static_cast<std::size_t>(k);
        const float inverse = planes_.inverse_range[i];
        if (inverse > 0.0F && planes_.deviation_m[i] <= max_deviation) {
            // Steps are powers of two, so that the thinned grid of neighbouring ranges shares its columns: a candidate
            // is left out where twice the largest step that it lies on is still within the spacing.
            if (k != 0 && static_cast<float>(2 * (k & -k) * config_.column_step) <= columns_at_1m * inverse) continue;
            const float b = planes_.slope_azimuth[i];
            const float g = planes_.slope_altitude[i];
            const float squared = inverse * inverse + b * b + g * g;
            if (inverse * inverse >= min_incidence * min_incidence * squared) {
                while (partial != planes_.partial.cend() && partial->window < k) ++partial;
                const bool is_partial = partial != planes_.partial.cend() && partial->window == k;
                const int delay = is_partial ? static_cast<int>(std::lround(partial->firing.time.centre)) : whole_delay;
                flat_.push_back({static_cast<PixelIndex>(first + c), static_cast<std::uint16_t>(measurement),
                                 static_cast<std::uint16_t>(std::clamp(measurement + delay, 0, w - 1)),
                                 direction_bin(windows_.in_lidar_axes(row, measurement, {-inverse, -b, -g})),
                                 is_partial ? static_cast<std::int32_t>(partial_.size()) : kWhole, inverse, b, g,
                                 planes_.deviation_m[i]});
                if (is_partial) partial_.push_back(partial->firing);
                continue;
            }
        }
        rough_.push_back({static_cast<PixelIndex>(first + c), static_cast<std::uint16_t>(measurement)});
    }
}

/// A flat candidate becomes a point: smoothed over its window, with its normal.
void Subsampling::write_flat(const Frame& frame, const Flat& c, PointSelection& points, std::size_t at) const {
    const int row = static_cast<int>(c.pixel) / sensor_.width;
    const WindowFiring& firing =
        c.partial == kWhole ? windows_.firing(row) : partial_[static_cast<std::size_t>(c.partial)];
    const BeamFrame beam = windows_.beam(row, c.measurement);
    const float inverse = c.inverse_range;
    const float b = c.slope_azimuth;
    const float g = c.slope_altitude;
    const float length = std::sqrt(inverse * inverse + b * b + g * g);
    // The normal in the axes of the beam, as if all pixels had one origin, and what their origins add.
    const float n[3] = {-inverse / length, -b / length, -g / length};
    float along_row = 0.0F;
    float up = 0.0F;
    for (int axis = 0; axis < 3; ++axis) {
        along_row += firing.origin[axis].along_row * n[axis];
        up += firing.origin[axis].up * n[axis];
    }
    const Eigen::Vector3f normal =
        (n[0] * beam.direction + (n[1] - inverse * along_row) * beam.along_row + (n[2] - inverse * up) * beam.up)
            .normalized();
    const float ratio = c.deviation_m / static_cast<float>(config_.max_deviation_m);
    const float smoothing = 1.0F / inverse - windows_.distance(frame.raw.range_mm[c.pixel]) + firing.origin[0].centre;
    const Eigen::Vector3f shift =
        smoothing * beam.direction + firing.origin[1].centre * beam.along_row + firing.origin[2].centre * beam.up;
    const auto column_s = static_cast<float>(sensor_.frame_period_s / sensor_.width);
    const Eigen::Vector3f time_gradient =
        column_s * inverse * (firing.time.along_row * beam.along_row + firing.time.up * beam.up);
    points.pixel[at] = c.pixel;
    points.measurement[at] = c.measurement;
    points.x[at] = frame.cloud.x[c.pixel] + shift.x();
    points.y[at] = frame.cloud.y[c.pixel] + shift.y();
    points.z[at] = frame.cloud.z[c.pixel] + shift.z();
    points.nx[at] = normal.x();
    points.ny[at] = normal.y();
    points.nz[at] = normal.z();
    points.planarity[at] = 1.0F - 0.9F * ratio * ratio;
    points.time_s[at] = std::min(0.0F, time_of(frame, c.measurement) + column_s * firing.time.centre);
    points.tx[at] = time_gradient.x();
    points.ty[at] = time_gradient.y();
    points.tz[at] = time_gradient.z();
}

/// Counting sort of the candidates' numbers into order_.
template <class Candidate>
void Subsampling::sort_by_firing(const std::vector<Candidate>& candidates) {
    next_.assign(static_cast<std::size_t>(sensor_.width) + 1, 0);
    for (const Candidate& c : candidates) ++next_[std::size_t{c.place()} + 1];
    for (std::size_t m = 1; m < next_.size(); ++m) next_[m] += next_[m - 1];
    order_.resize(candidates.size());
    for (std::size_t i = 0; i < candidates.size(); ++i) {
        order_[next_[candidates[i].place()]++] = static_cast<std::uint32_t>(i);
    }
}

/// Leaves the candidates that are kept: of flat ones every count/share-th of a bin, of the others every
/// count/rough_points-th, spread evenly over the image.
void Subsampling::thin_out() {
    std::array<int, kDirections> count{};
    for (const Flat& candidate : flat_) ++count[candidate.direction];
    const int share = fair_share(count, config_.points);
    std::array<int, kDirections> credit{};
    std::erase_if(flat_, [&](const Flat& candidate) {
        return !is_next(share, count[candidate.direction], credit[candidate.direction]);
    });
    const auto rough = static_cast<int>(rough_.size());
    int rough_credit = 0;
    std::erase_if(rough_, [&](const Rough&) { return !is_next(config_.rough_points, rough, rough_credit); });
}

void Subsampling::select(Frame& frame) {
    thin_out();
    PointSelection& points = frame.prepared.points;
    const std::size_t total = flat_.size() + rough_.size();
    // Room for all candidates once and for all: a frame that has more of them than those before must not allocate.
    points.pixel.reserve(flat_.capacity());
    points.measurement.reserve(flat_.capacity());
    points.pixel.resize(total);
    points.measurement.resize(total);
    for (auto* values : {&points.x, &points.y, &points.z, &points.nx, &points.ny, &points.nz, &points.planarity,
                         &points.time_s, &points.tx, &points.ty, &points.tz}) {
        values->reserve(flat_.capacity());
        values->resize(total);
    }
    // In the order of their firing, so that neighbours share their place in the sweep.
    sort_by_firing(flat_);
    std::size_t at = 0;
    for (const std::uint32_t i : order_) write_flat(frame, flat_[i], points, at++);
    sort_by_firing(rough_);
    const int available = static_cast<int>(rough_.size());
    const int wanted = std::clamp(config_.least_points - static_cast<int>(flat_.size()), 0, available);
    int credit = 0;
    for (const std::uint32_t i : order_) {
        const Rough& c = rough_[i];
        const bool takes_part = wanted > 0 && is_next(wanted, available, credit);
        points.pixel[at] = c.pixel;
        points.measurement[at] = c.measurement;
        points.x[at] = frame.cloud.x[c.pixel];
        points.y[at] = frame.cloud.y[c.pixel];
        points.z[at] = frame.cloud.z[c.pixel];
        points.nx[at] = points.ny[at] = points.nz[at] = 0.0F;
        points.tx[at] = points.ty[at] = points.tz[at] = 0.0F;
        points.planarity[at] = takes_part ? kRawPlanarity : 0.0F;
        points.time_s[at] = time_of(frame, c.measurement);
        ++at;
    }
}

}  // namespace dlod
