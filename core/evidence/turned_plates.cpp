#include "core/evidence/turned_plates.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>

namespace dlod {
namespace {

constexpr std::size_t kNewer = 0, kOlder = 1;  // of the two references
constexpr std::size_t kFewestSeeds = 6;
constexpr std::size_t kMostPlaces = 16;
constexpr int kSeedGap_columns = 12;
constexpr double kSeedGap_m = 0.6;
constexpr double kSeedNoise_m = 0.03;    // of seeds about their line
constexpr double kMostPixels = 4000.0;   // of a place: of larger ones so many columns and rows are left out
constexpr double kFewerPixels = 1500.0;  // likewise where something has come nearer: that is seen more clearly
constexpr double kReach_m = 0.1;         // from the seeds' line
constexpr int kFewestPoints = 16;
constexpr double kBin_m = 0.04;
constexpr int kBins = 256;
constexpr double kMostly = 0.5;
constexpr double kPlane = 0.7;        // of the points lay in one plane before, too
constexpr double kPartOfPlane = 0.3;  // where it has come nearer
constexpr std::size_t kTrials = 24;   // points of which each two are tried as a line
constexpr double kApart = 0.25;       // of the plate's length between them
constexpr double kCorrelated = 4.0;   // windows of neighbours share pixels
constexpr double kFloor_rad = 0.003;  // of a direction, however many points: pose, ranges, walls that are not flat
constexpr double kSigmas = 5.0;
constexpr double kHinge = 0.5;      // of its length a plate's axis may lie beyond its ends
constexpr std::size_t kLooks = 48;  // points whose former places are looked at
constexpr std::size_t kFewestLooks = 6;
constexpr double kLeastShare =
    0.2;  // of the shift since the older reference that is since the newer one: it still moves
constexpr double kMostShare = 1.3;
constexpr double kSteadyShare = 0.75;  // where there is no axis: at constant speed it is half
constexpr double kFarther = 1.5;       // of the shift of its free end
constexpr int kFewestSeen = 4;
constexpr double kTold_m = 0.005;  // the mean of some points tells such a shift
constexpr double kStayed = 0.5;    // of the shift that is expected
constexpr double kPlain_m = 0.02;  // by which points have plainly moved

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
      taken_(sensor.height, sensor.width, 0) {
    seeds_.reserve(4096);
    places_.reserve(kMostPlaces);
    points_.reserve(sensor.pixels() / 4);
    formers_.reserve(sensor.pixels() / 4);
    looks_.reserve(sensor.pixels() / 4);
    sorted_.reserve(sensor.pixels() / 4);
    pixels_.reserve(sensor.pixels());
    ends_.reserve(kMostPlaces);
}

void TurnedPlates::begin() {
    for (const PixelIndex pixel : pixels_) taken_[pixel] = 0;
    places_.clear();
    pixels_.clear();
    ends_.clear();
}

/// Least squares over the points that `use` gives.
template <class Use>
TurnedPlates::Line TurnedPlates::fit(const Line& start, Use use) const {
    Eigen::Vector2d sum = Eigen::Vector2d::Zero();
    Eigen::Matrix2d squares = Eigen::Matrix2d::Zero();
    int n = 0;
    use([&](const Eigen::Vector2d& p) {
        const Eigen::Vector2d d = p - start.middle;
        sum += d;
        squares += d * d.transpose();
        ++n;
    });
    Line line = start;
    line.points = n;
    if (n < 3) return line;
    const Eigen::Vector2d mean = sum / n;
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> eigen(squares / n - mean * mean.transpose());
    line.middle = start.middle + mean;
    line.along = eigen.eigenvectors().col(1);
    if (line.along.dot(start.along) < 0.0) line.along = -line.along;
    line.spread_m = std::sqrt(std::max(0.0, eigen.eigenvalues()[1]));
    line.noise_m = std::sqrt(std::max(0.0, eigen.eigenvalues()[0]));
    return line;
}

void TurnedPlates::request(const Frame& frame, std::span<const std::uint8_t> whole, EvidenceImage& evidence) {
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

void TurnedPlates::add_place(std::span<const Seed> seeds, const Frame& frame, EvidenceImage& evidence) {
    Line line;
    line.middle = seeds.front().point.head<2>();
    line = fit(line, [&](auto add) {
        for (const Seed& seed : seeds) add(seed.point.head<2>());
    });
    // Once more without those that lie off it.
    const double limit_m = std::max(kSeedNoise_m, 1.5 * line.noise_m);
    Place place;
    place.low_m = 1e9;
    place.high_m = -1e9;
    int top = sensor_.height, bottom = 0;
    place.line = fit(line, [&](auto add) {
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
        most_common_line(line, place.to_m - place.from_m).points < kMostly * static_cast<double>(formers_.size()))
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

    const OdometryResult& odometry = frame.odometry;
    const Eigen::Matrix3f R = odometry.T_world_sensor.linear().cast<float>();
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
            if (std::abs(d) < static_cast<float>(2.0 * kReach_m)) evidence.request(pixel);
        }
    }
}

void TurnedPlates::collect(const Frame& frame, const EvidenceImage& evidence, const Place& place) {
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
        Point& point = points_.emplace_back();
        point.now = p;
        for (std::size_t k = 0; k < origin.size(); ++k) {
            const auto shift = static_cast<double>(tested.shift[k][i]);
            point.known[k] = tested.shift[k][i] != CandidatePoints::kNoShift;
            point.before[k] = p - (point.known[k] ? shift : 0.0) * (p - origin[k]).normalized();
        }
    }
}

/// The line that most of the former places lie on: some lie on it and others on what was seen past the plate's end.
TurnedPlates::Line TurnedPlates::most_common_line(const Line& start, double length_m) const {
    const std::size_t n = std::min<std::size_t>(formers_.size(), kTrials);
    const auto sample = [&](std::size_t k) -> const Eigen::Vector2d& { return formers_[k * formers_.size() / n]; };
    Line best = start;
    int most = -1;
    for (std::size_t i = 0; i < n; ++i) {
        for (std::size_t j = i + 1; j < n; ++j) {
            const Eigen::Vector2d d = sample(j) - sample(i);
            const double length = d.norm();
            if (length < kApart * length_m) continue;
            Line line;
            line.middle = sample(i);
            line.along = d / length;
            int near = 0;
            for (std::size_t k = 0; k < n; ++k) near += std::abs(line.across(sample(k))) < config_.tolerance_m ? 1 : 0;
            if (near <= most) continue;
            most = near;
            best = line;
        }
    }
    if (best.along.dot(start.along) < 0.0) best.along = -best.along;
    for (int round = 0; round < 2; ++round) {
        const Line rough = best;
        best = fit(rough, [&](auto add) {
            for (const Eigen::Vector2d& p : formers_) {
                if (std::abs(rough.across(p)) < config_.tolerance_m) add(p);
            }
        });
    }
    return best;
}

bool TurnedPlates::find_turn(const Place& place, std::size_t reference, Turn& turn) {
    const double low_m = place.low_m - 0.1, high_m = place.high_m + 0.1;
    double from_m = place.from_m - 0.05, to_m = place.to_m + 0.05;
    Line now = place.line, before;
    const Eigen::Vector2d anchor = now.middle + 0.5 * (place.from_m + place.to_m) * now.along;
    double reach_m = kReach_m;
    for (int round = 0; round < 3; ++round) {
        const auto used = [&](const Line& line, const Point& p) {
            if (!p.known[reference] || p.now.z() < low_m || p.now.z() > high_m) return false;
            const double at = line.at(p.now.head<2>());
            return at >= from_m && at <= to_m && std::abs(line.across(p.now.head<2>())) < reach_m;
        };
        const Line start = now;
        now = fit(start, [&](auto add) {
            for (const Point& p : points_) {
                if (used(start, p)) add(p.now.head<2>());
            }
        });
        if (now.points < kFewestPoints) return false;
        formers_.clear();
        for (const Point& p : points_) {
            if (used(start, p)) formers_.push_back(p.before[reference].head<2>());
        }
        before = most_common_line(now, to_m - from_m);
        // Where it has come nearer, the rest has been seen beside it.
        if (before.points < (place.side > 0 ? kPlane : kPartOfPlane) * now.points) return false;
        const double sine = before.normal().dot(now.along);
        turn.turn_rad = std::asin(std::clamp(sine, -1.0, 1.0));
        const double offset_m = before.across(now.middle);
        turn.hinge_m = std::abs(sine) > 1e-6 ? -offset_m / sine : 1e6;
        // Both ends: to the axis, or else as far as points have moved.
        std::array<int, kBins> on{}, moved{}, all{}, seen{};
        std::array<double, kBins> shift_m{};
        const double most_m = kFarther * far_shift_m(from_m, to_m, turn) + config_.tolerance_m;
        const double first_m = now.at(anchor) - 0.5 * kBins * kBin_m;
        for (const Point& p : points_) {
            if (p.now.z() < low_m || p.now.z() > high_m) continue;
            const double at = (now.at(p.now.head<2>()) - first_m) / kBin_m;
            if (at < 0.0 || at >= kBins) continue;
            const auto bin = static_cast<std::size_t>(at);
            const double a = std::abs(now.across(p.now.head<2>())), b = std::abs(before.across(p.now.head<2>()));
            ++all[bin];
            on[bin] += a < config_.tolerance_m ? 1 : 0;
            moved[bin] += a < config_.tolerance_m && a < b ? 1 : 0;
            const double d = now.across(p.before[reference].head<2>());
            if (a > config_.tolerance_m || !p.known[reference] || std::abs(d) > most_m) continue;
            shift_m[bin] += d;
            ++seen[bin];
        }
        // What lies in the plane beyond the axis, as a door's frame, has not moved.
        const auto stayed = [&](std::size_t bin) {
            const double at = first_m + (static_cast<double>(bin) + 0.5) * kBin_m;
            const double expected_m = -before.across(now.middle + at * now.along);
            if (std::abs(expected_m) < kTold_m || seen[bin] < kFewestSeen) return false;
            return shift_m[bin] / seen[bin] / expected_m < kStayed;
        };
        const auto end = [&](int direction) {
            const double hinge = (turn.hinge_m - first_m) / kBin_m;
            const double middle = 0.5 * kBins;
            const bool to_hinge = (hinge - middle) * direction > 0.0;
            int last = kBins / 2;
            int gap = 0;
            for (int bin = last; bin >= 0 && bin < kBins; bin += direction) {
                const auto i = static_cast<std::size_t>(bin);
                if (to_hinge && (bin + 0.5 - hinge) * direction > 0.0) break;
                if (to_hinge && stayed(i)) break;
                const int enough = to_hinge ? on[i] : moved[i];
                if (all[i] > 0 && enough >= kMostly * all[i]) {
                    last = bin;
                    gap = 0;
                } else if (++gap > 2) {
                    break;
                }
            }
            const double last_m = first_m + (last + (direction > 0 ? 1 : 0)) * kBin_m;
            return to_hinge && (last_m - turn.hinge_m) * direction > 0.0 ? turn.hinge_m : last_m;
        };
        from_m = end(-1);
        to_m = end(1);
        reach_m = config_.tolerance_m;
    }
    turn.now = now;
    turn.before = before;
    turn.from_m = from_m;
    turn.to_m = to_m;
    return true;
}

bool TurnedPlates::has_turned(const Turn& turn) const {
    const double length_m = turn.to_m - turn.from_m;
    if (length_m < config_.min_length_m || length_m > config_.max_length_m) return false;
    const auto variance = [](const Line& line) {
        return kCorrelated * line.noise_m * line.noise_m / (line.points * line.spread_m * line.spread_m);
    };
    const double sd = std::sqrt(variance(turn.now) + variance(turn.before) + kFloor_rad * kFloor_rad);
    if (std::abs(turn.turn_rad) < std::max(config_.min_turn_rad, kSigmas * sd)) return false;
    if (std::abs(turn.turn_rad) > config_.max_turn_rad) return false;
    return far_shift_m(turn.from_m, turn.to_m, turn) > config_.min_shift_m;
}

/// By how much the end has moved that is farther from the axis.
double TurnedPlates::far_shift_m(double from_m, double to_m, const Turn& turn) {
    const double far_m = std::max(std::abs(turn.hinge_m - from_m), std::abs(turn.hinge_m - to_m));
    return far_m * std::abs(std::sin(turn.turn_rad));
}

/// Of the plate, and in its half that moves more.
bool TurnedPlates::is_far_from_axis(const Turn& turn, const Point& p) const {
    const bool hinge_first = std::abs(turn.hinge_m - turn.from_m) < std::abs(turn.hinge_m - turn.to_m);
    const double middle_m = 0.5 * (turn.from_m + turn.to_m);
    const double at = turn.now.at(p.now.head<2>());
    return at >= (hinge_first ? middle_m : turn.from_m) && at <= (hinge_first ? turn.to_m : middle_m) &&
           p.now.z() >= turn.low_m && p.now.z() <= turn.high_m &&
           std::abs(turn.now.across(p.now.head<2>())) <= config_.tolerance_m;
}

/// What was there is there no longer: an edge that hid the plane is seen at its place still.
bool TurnedPlates::is_gone(const Frame& frame, const EvidenceImage& evidence, const Place& place, const Turn& turn,
                           std::size_t reference) {
    const Eigen::Matrix3d R = frame.odometry.T_world_sensor.linear();
    looks_.clear();
    for (const Point& p : points_) {
        if (!p.known[reference] || !is_far_from_axis(turn, p) ||
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
        const Point& p = *looks_[k * looks_.size() / n];
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
    for (const Place& place : places_) {
        collect(frame, evidence, place);
        Turn turn;
        // The older reference shows more of a turn, the newer one more of the plate.
        std::size_t reference = kOlder;
        bool found = find_turn(place, reference, turn) && has_turned(turn);
        if (!found) {
            reference = kNewer;
            turn = {};
            found = find_turn(place, reference, turn) && has_turned(turn);
        }
        if (!found) continue;
        set_heights(turn);
        const bool gone = is_gone(frame, evidence, place, turn, reference);
        const double last = shift_m(turn, kNewer), earlier = shift_m(turn, kOlder);
        const double length_m = turn.to_m - turn.from_m;
        const bool hinged =
            turn.hinge_m > turn.from_m - kHinge * length_m && turn.hinge_m < turn.to_m + kHinge * length_m;
        const double share = earlier != 0.0 ? last / earlier : 0.0;
        const bool goes_on = share > kLeastShare && share < (hinged ? kMostShare : kSteadyShare);
        if (gone && goes_on && turn.high_m - turn.low_m > config_.min_height_m) fill(frame, place, turn);
    }
}

/// Mean distance by which the plate's outer half has moved.
double TurnedPlates::shift_m(const Turn& turn, std::size_t reference) const {
    double sum = 0.0;
    int n = 0;
    // Farther away is what was seen past the plate's end.
    const double most_m = kFarther * far_shift_m(turn.from_m, turn.to_m, turn) + config_.tolerance_m;
    for (const Point& p : points_) {
        if (!p.known[reference] || !is_far_from_axis(turn, p)) continue;
        const double d = turn.now.across(p.before[reference].head<2>());
        if (std::abs(d) > most_m) continue;
        sum += d;
        ++n;
    }
    return n > 0 ? sum / n : 0.0;
}

/// Between those of the points that have moved.
void TurnedPlates::set_heights(Turn& turn) {
    sorted_.clear();
    for (const Point& p : points_) {
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

void TurnedPlates::fill(const Frame& frame, const Place& place, const Turn& turn) {
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
                p.z() < static_cast<float>(turn.low_m - kBin_m) || p.z() > static_cast<float>(turn.high_m + kBin_m))
                continue;
            taken_[pixel] = 1;
            pixels_.push_back(pixel);
        }
    }
    if (pixels_.size() > first) ends_.push_back(pixels_.size());
}

}  // namespace dlod
