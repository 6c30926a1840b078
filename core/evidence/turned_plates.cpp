#include "core/evidence/turned_plates.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace dlod {
namespace {

constexpr std::size_t kMostPlates = 16;
constexpr double kMostly = 0.5;     // of the shift that is expected
constexpr std::size_t kLooks = 48;  // points whose former places are looked at
constexpr std::size_t kFewestLooks = 6;
// Of the shift since the older reference that is since the newer one: it still moves,
constexpr double kLeastShare = 0.2;
constexpr double kMostShare = 1.3;
constexpr double kSteadyShare = 0.75;  // and where there is no axis, at constant speed it is half
constexpr double kPlain_m = 0.02;      // by which points have plainly moved
constexpr double kHeightMargin_m = 0.04;

int wrapped(int column, int reference, int width) {
    const int d = (column - reference) % width;
    return d < 0 ? d + width : d;
}

}  // namespace

TurnedPlates::TurnedPlates(const SensorModel& sensor, const TurnedPlatesConfig& config, int narrow_bits)
    : sensor_(sensor),
      config_(config),
      projection_(sensor),
      narrow_bits_(narrow_bits),
      places_(sensor, config),
      turn_fit_(config, sensor.pixels() / 4),
      taken_(sensor.height, sensor.width, 0) {
    points_.reserve(sensor.pixels() / 4);
    looks_.reserve(sensor.pixels() / 4);
    sorted_.reserve(sensor.pixels() / 4);
    pixels_.reserve(sensor.pixels());
    ends_.reserve(kMostPlates);
}

void TurnedPlates::begin() {
    for (const PixelIndex pixel : pixels_) taken_[pixel] = 0;
    places_.begin();
    pixels_.clear();
    ends_.clear();
}

void TurnedPlates::collect(const Frame& frame, const EvidenceImage& evidence, const PlatePlace& place) {
    points_.clear();
    const CandidatePoints& tested = evidence.points();
    const Eigen::Isometry3d& T_world_sensor = frame.odometry.T_world_sensor;
    const Eigen::Matrix3d R = T_world_sensor.linear();
    // Where the references looked from, world axes about the sensor now.
    std::array<Eigen::Vector3d, CandidatePoints::kShifts> origin;
    const int middle = (place.first_column + place.columns / 2) % sensor_.width;
    const auto block = static_cast<std::size_t>(middle * Reference::kBlocks / sensor_.width);
    for (std::size_t k = 0; k < origin.size(); ++k) {
        const Reference& reference = *evidence.references()[k];
        origin[k] = reference.T_world_sensor * reference.T_block_stamp[block].cast<double>().inverse().translation() -
                    T_world_sensor.translation();
    }
    for (std::size_t i = 0; i < tested.size() && points_.size() < points_.capacity(); ++i) {
        const PixelIndex pixel = tested.pixel[i];
        const int row = static_cast<int>(pixel) / sensor_.width;
        if (row < place.first_row || row >= place.first_row + place.rows ||
            frame.prepared.segment[pixel] != place.label)
            continue;
        if (wrapped(static_cast<int>(pixel) % sensor_.width, place.first_column, sensor_.width) >= place.columns)
            continue;
        const Eigen::Vector3d p =
            R * Eigen::Vector3d(static_cast<double>(tested.x[i]), static_cast<double>(tested.y[i]),
                                static_cast<double>(tested.z[i]));
        PlatePoint& point = points_.emplace_back();
        point.now = p;
        for (std::size_t k = 0; k < origin.size(); ++k) {
            const auto shift = static_cast<double>(tested.shift[k][i]);
            point.known[k] = tested.shift[k][i] != CandidatePoints::kNoShift;
            point.before[k] = p - (point.known[k] ? shift : 0.0) * (p - origin[k]).normalized();
        }
    }
}

/// What was there is there no longer: an edge that hid the plane is seen at its place still.
bool TurnedPlates::is_gone(const Frame& frame, const EvidenceImage& evidence, const PlatePlace& place,
                           const PlateTurn& turn, std::size_t reference) {
    const Eigen::Matrix3d R = frame.odometry.T_world_sensor.linear();
    looks_.clear();
    for (const PlatePoint& p : points_) {
        if (!p.known[reference] || !turn.is_far_from_axis(p.now, config_.tolerance_m) ||
            std::abs(turn.before.across(p.before[reference].head<2>())) > config_.tolerance_m)
            continue;
        looks_.push_back(&p);
    }
    if (looks_.size() < kFewestLooks) return false;
    const std::size_t n = std::min(looks_.size(), kLooks);
    std::array<float, kLooks> x, y, z, range;
    std::array<std::int32_t, kLooks> pixel;
    std::array<double, kLooks> moved_m;
    for (std::size_t k = 0; k < n; ++k) {
        const PlatePoint& p = *looks_[k * looks_.size() / n];
        const Eigen::Vector3f q = (R.transpose() * p.before[reference]).cast<float>();
        x[k] = q.x();
        y[k] = q.y();
        z[k] = q.z();
        moved_m[k] = p.now.norm() - p.before[reference].norm();
    }
    const Reference& now = evidence.now();
    const int column = (place.first_column + place.columns / 2) % sensor_.width;
    const auto block = static_cast<std::size_t>(column * Reference::kBlocks / sensor_.width);
    projection_.project(now.T_block_stamp[block], static_cast<int>(n), x.data(), y.data(), z.data(),
                        now.column_shift.data(), pixel.data(), range.data());
    double expected_m = 0.0, seen_m = 0.0;
    for (std::size_t k = 0; k < n; ++k) {
        const std::uint32_t seen = pixel[k] < 0 ? 0U : now.cells[static_cast<std::size_t>(pixel[k]) >> narrow_bits_];
        if (seen == 0U) continue;
        const float middle = 0.5F * kReferenceUnit_m * static_cast<float>((seen & 0xFFFFU) + (seen >> 16U));
        expected_m += moved_m[k];
        seen_m += static_cast<double>(middle - range[k]);
    }
    return expected_m > 0.0 ? seen_m > kMostly * expected_m : seen_m < kMostly * expected_m;
}

void TurnedPlates::find(const Frame& frame, const EvidenceImage& evidence) {
    for (const PlatePlace& place : places_.found()) {
        collect(frame, evidence, place);
        // The older reference shows more of a turn, the newer one more of the plate: either may tell.
        for (const std::size_t reference : {kOlder, kNewer}) {
            const std::optional<PlateTurn> turn = find_plate(frame, evidence, place, reference);
            if (!turn) continue;
            fill(frame, place, *turn);
            break;
        }
    }
}

/// The plate that the points of the place are, if they are one that has turned since the reference and still does.
std::optional<PlateTurn> TurnedPlates::find_plate(const Frame& frame, const EvidenceImage& evidence,
                                                  const PlatePlace& place, std::size_t reference) {
    std::optional<PlateTurn> turn = turn_fit_.find(points_, place, reference);
    if (!turn) return std::nullopt;
    set_heights(*turn);
    const bool plate = turn->high_m - turn->low_m > config_.min_height_m && goes_on(*turn) &&
                       is_gone(frame, evidence, place, *turn, reference);
    return plate ? turn : std::nullopt;
}

/// It has turned since either reference, and the less since the newer one.
bool TurnedPlates::goes_on(const PlateTurn& turn) const {
    const double last_m = shift_m(turn, kNewer), earlier_m = shift_m(turn, kOlder);
    const double share = earlier_m != 0.0 ? last_m / earlier_m : 0.0;
    return share > kLeastShare && share < (turn.is_hinged() ? kMostShare : kSteadyShare);
}

/// Mean distance by which the plate's outer half has moved.
double TurnedPlates::shift_m(const PlateTurn& turn, std::size_t reference) const {
    double sum = 0.0;
    int n = 0;
    const double most_m = turn.most_shift_m(config_.tolerance_m);
    for (const PlatePoint& p : points_) {
        if (!p.known[reference] || !turn.is_far_from_axis(p.now, config_.tolerance_m)) continue;
        const double d = turn.now.across(p.before[reference].head<2>());
        if (std::abs(d) > most_m) continue;
        sum += d;
        ++n;
    }
    return n > 0 ? sum / n : 0.0;
}

/// Between those of the points that have moved.
void TurnedPlates::set_heights(PlateTurn& turn) {
    sorted_.clear();
    for (const PlatePoint& p : points_) {
        const Eigen::Vector2d xy = p.now.head<2>();
        const double at = turn.now.at(xy);
        const double a = std::abs(turn.now.across(xy)), b = std::abs(turn.before.across(xy));
        if (at > turn.from_m && at < turn.to_m && a < config_.tolerance_m && b > std::max(2.0 * a, kPlain_m))
            sorted_.push_back(p.now.z());
    }
    if (sorted_.empty()) return;
    std::sort(sorted_.begin(), sorted_.end());
    turn.low_m = sorted_[sorted_.size() / 50];
    turn.high_m = sorted_[sorted_.size() - 1 - sorted_.size() / 50];
}

void TurnedPlates::fill(const Frame& frame, const PlatePlace& place, const PlateTurn& turn) {
    const OdometryResult& odometry = frame.odometry;
    const Eigen::Matrix3f R = odometry.T_world_sensor.linear().cast<float>();
    const std::size_t first = pixels_.size();
    const Eigen::Vector2f middle = turn.now.middle.cast<float>();
    const Eigen::Vector2f along = turn.now.along.cast<float>();
    for (int r = place.first_row; r < place.first_row + place.rows; ++r) {
        for (int k = 0; k < place.columns; ++k) {
            const auto pixel = static_cast<PixelIndex>(r * sensor_.width + (place.first_column + k) % sensor_.width);
            if (frame.prepared.segment[pixel] != place.label || taken_[pixel] != 0) continue;
            const Eigen::Vector3f p = R * Eigen::Vector3f(odometry.x[pixel], odometry.y[pixel], odometry.z[pixel]);
            const Eigen::Vector2f d = p.head<2>() - middle;
            const float at = along.dot(d);
            const float across = along.x() * d.y() - along.y() * d.x();
            if (at < static_cast<float>(turn.from_m) || at > static_cast<float>(turn.to_m) ||
                std::abs(across) > static_cast<float>(config_.tolerance_m) ||
                p.z() < static_cast<float>(turn.low_m - kHeightMargin_m) ||
                p.z() > static_cast<float>(turn.high_m + kHeightMargin_m))
                continue;
            taken_[pixel] = 1;
            pixels_.push_back(pixel);
        }
    }
    if (pixels_.size() > first) ends_.push_back(pixels_.size());
}

}  // namespace dlod
