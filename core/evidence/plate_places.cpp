#include "core/evidence/plate_places.hpp"

#include <algorithm>
#include <cmath>

namespace dlod {
namespace {

constexpr std::size_t kFewestSeeds = 6;
constexpr std::size_t kMostPlaces = 16;
constexpr int kSeedGap_columns = 12;
constexpr double kSeedGap_m = 0.6;
constexpr double kSeedNoise_m = 0.03;    // of seeds about their line
constexpr double kMostPixels = 4000.0;   // of a place: of larger ones so many columns and rows are left out
constexpr double kFewerPixels = 1500.0;  // likewise where something has come nearer: that is seen more clearly
constexpr double kMostly = 0.5;          // of the seeds lay in one plane before
constexpr double kPartOfPlane = 0.3;     // or may have, where it has come nearer

}  // namespace

PlatePlaces::PlatePlaces(const SensorModel& sensor, const TurnedPlatesConfig& config)
    : sensor_(sensor), config_(config) {
    seeds_.reserve(4096);
    places_.reserve(kMostPlaces);
    formers_.reserve(4096);
}

void PlatePlaces::request(const Frame& frame, std::span<const std::uint8_t> whole, EvidenceImage& evidence) {
    if (evidence.references().size() < CandidatePoints::kShifts) return;
    const CandidatePoints& points = evidence.points();
    const Eigen::Isometry3d& T_world_sensor = frame.odometry.T_world_sensor;
    const Eigen::Matrix3d R = T_world_sensor.linear();
    const Eigen::Vector3d origin =
        evidence.references()[kOlder]->T_world_sensor.translation() - T_world_sensor.translation();
    seeds_.clear();
    for (std::size_t i = 0; i < points.size() && seeds_.size() < seeds_.capacity(); ++i) {
        if (points.outside[i] == 0.0F) continue;
        const PixelIndex pixel = points.pixel[i];
        const std::uint32_t segment = frame.prepared.segment[pixel] - 1;
        if (whole[segment] != 0) continue;
        const auto shift_m = static_cast<double>(points.shift[kOlder][i]);
        if (shift_m > config_.max_shift_m) continue;
        const Eigen::Vector3d p =
            R * Eigen::Vector3d(static_cast<double>(points.x[i]), static_cast<double>(points.y[i]),
                                static_cast<double>(points.z[i]));
        seeds_.push_back({segment, points.outside[i] < 0.0F ? -1 : 1, static_cast<int>(pixel) % sensor_.width,
                          static_cast<int>(pixel) / sensor_.width, p,
                          (p - shift_m * (p - origin).normalized()).head<2>()});
    }
    std::sort(seeds_.begin(), seeds_.end(), [](const Seed& a, const Seed& b) {
        if (a.segment != b.segment) return a.segment < b.segment;
        if (a.side != b.side) return a.side < b.side;
        return a.column != b.column ? a.column < b.column : a.row < b.row;
    });
    for (std::size_t first = 0, i = 1; i <= seeds_.size(); ++i) {
        const bool ends = i == seeds_.size() || seeds_[i].segment != seeds_[first].segment ||
                          seeds_[i].side != seeds_[first].side ||
                          seeds_[i].column - seeds_[i - 1].column > kSeedGap_columns ||
                          (seeds_[i].point - seeds_[i - 1].point).head<2>().norm() > kSeedGap_m;
        if (!ends) continue;
        if (i - first >= kFewestSeeds && places_.size() < kMostPlaces)
            add_place(std::span<const Seed>(seeds_).subspan(first, i - first), frame, evidence);
        first = i;
    }
}

void PlatePlaces::add_place(std::span<const Seed> seeds, const Frame& frame, EvidenceImage& evidence) {
    PlanLine line;
    line.middle = seeds.front().point.head<2>();
    line = fit_line(line, [&](auto add) {
        for (const Seed& seed : seeds) add(seed.point.head<2>());
    });
    // Once more without those that lie off it.
    const double limit_m = std::max(kSeedNoise_m, 1.5 * line.noise_m);
    PlatePlace place;
    place.low_m = 1e9;
    place.high_m = -1e9;
    int top = sensor_.height, bottom = 0;
    place.line = fit_line(line, [&](auto add) {
        for (const Seed& seed : seeds) {
            if (std::abs(line.across(seed.point.head<2>())) > limit_m) continue;
            add(seed.point.head<2>());
            place.low_m = std::min(place.low_m, seed.point.z());
            place.high_m = std::max(place.high_m, seed.point.z());
            top = std::min(top, seed.row);
            bottom = std::max(bottom, seed.row);
        }
    });
    line = place.line;
    if (line.points < static_cast<int>(kFewestSeeds) || line.noise_m > kSeedNoise_m) return;
    if (place.high_m - place.low_m < config_.min_height_m) return;
    place.from_m = 1e9;
    place.to_m = -1e9;
    for (const Seed& seed : seeds) {
        if (std::abs(line.across(seed.point.head<2>())) > limit_m) continue;
        place.from_m = std::min(place.from_m, line.at(seed.point.head<2>()));
        place.to_m = std::max(place.to_m, line.at(seed.point.head<2>()));
    }
    // What has gone farther lay in another plane before; where it has come nearer one may have seen past its end.
    formers_.clear();
    for (const Seed& seed : seeds) {
        if (std::abs(line.across(seed.point.head<2>())) <= limit_m &&
            (seed.before - seed.point.head<2>()).norm() < config_.max_shift_m)
            formers_.push_back(seed.before);
    }
    if (static_cast<double>(formers_.size()) < kPartOfPlane * line.points) return;
    if (seeds.front().side > 0 &&
        most_common_line(formers_, line, place.to_m - place.from_m, config_.tolerance_m).points <
            kMostly * static_cast<double>(formers_.size()))
        return;
    const int width = sensor_.width;
    const int own = seeds.back().column - seeds.front().column + 1;
    const int beside = std::clamp(2 * own, 8, width / 8);
    place.label = seeds.front().segment + 1;
    place.side = seeds.front().side;
    place.columns = std::min(width, own + 2 * beside);
    place.first_column = ((seeds.front().column - beside) % width + width) % width;
    const int more = std::max(4, (bottom - top) / 4);
    place.first_row = std::max(0, top - more);
    place.rows = std::min(sensor_.height, bottom + more + 1) - place.first_row;
    places_.push_back(place);
    request_around(place, frame, evidence);
}

/// What of the segment lies near the line, there and beside.
void PlatePlaces::request_around(const PlatePlace& place, const Frame& frame, EvidenceImage& evidence) const {
    const OdometryResult& odometry = frame.odometry;
    const Eigen::Matrix3f R = odometry.T_world_sensor.linear().cast<float>();
    const PlanLine& line = place.line;
    const int width = sensor_.width;
    const Eigen::Vector2f n = line.normal().cast<float>();
    const Eigen::Vector3f across(n.x() * R(0, 0) + n.y() * R(1, 0), n.x() * R(0, 1) + n.y() * R(1, 1),
                                 n.x() * R(0, 2) + n.y() * R(1, 2));
    const auto offset = static_cast<float>(line.normal().dot(line.middle));
    const int step =
        1 + static_cast<int>(std::sqrt(place.columns * place.rows / (place.side > 0 ? kMostPixels : kFewerPixels)));
    for (int r = place.first_row; r < place.first_row + place.rows; r += step) {
        for (int k = 0; k < place.columns; k += step) {
            const auto pixel = static_cast<PixelIndex>(r * width + (place.first_column + k) % width);
            if (frame.prepared.segment[pixel] != place.label) continue;
            const float d = across.x() * odometry.x[pixel] + across.y() * odometry.y[pixel] +
                            across.z() * odometry.z[pixel] - offset;
            if (std::abs(d) < static_cast<float>(2.0 * kPlateReach_m)) evidence.request(pixel);
        }
    }
}

}  // namespace dlod
