#include "core/map/global_map.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/types/multiversion.hpp"

namespace dlod {

namespace {

constexpr std::size_t kClearedCellsAFrame = 4000;
constexpr std::size_t kSweptSlotsAFrame = 4000;
constexpr double kForgottenShare = 0.1;  // of a full map, at a time
// A run too short to confirm much: what has stayed for this share of it is static.
constexpr double kConfirmShareOfRun = 0.25;
constexpr std::int64_t kDecisecond_ns = 100'000'000;
constexpr std::int64_t kLongestTurn_ns =
    1'000'000'000;  // a longer step is the clock's, or a gap in which nothing was seen

// Objects longer than people are seen in pieces, not all of which are known to be theirs: what lies in their boxes, and
// not on the ground, is kept out.
constexpr double kSeenInPieces_m = 2.5;
constexpr double kPieceMargin_m = 0.2;
constexpr double kGroundClearance_m = 0.15;
// Nothing stands where a vehicle has just driven: what is there is more of it, and its side slides along itself, so
// that it looks at rest. Of a bus of twelve metres the first four may be all that is known.
constexpr double kMayFollow_m = 8.0;
constexpr double kDriving_mps = 1.0;
constexpr double kAhead = 0.9;  // cosine between its length and its way

constexpr std::size_t kRowStep = 4;
/// Near pixels lie many to a cell: of the pixels of a row every eighth, fourth, second, every one enters.
constexpr float kNearest_m = 4.0F, kNear_m = 8.0F, kMiddle_m = 16.0F;

/// What one frame adds and clears, kept until it is its turn.
struct Postponed {
    std::int64_t time_ns = 0;
    std::int64_t stamp_ns = 0;
    MapPoints points;
    std::vector<OrientedBox> cleared;
};

Persistence::Rule rule_of(const GlobalMapConfig& config) {
    return {static_cast<std::uint16_t>(std::lround(10.0 * config.confirm_s)),
            static_cast<std::uint16_t>(std::lround(10.0 * config.forget_s))};
}

std::uint16_t deciseconds(std::int64_t time_ns) {
    return static_cast<std::uint16_t>(time_ns / kDecisecond_ns);
}

/// 1 for the pixels of a row that enter.
DLOD_MULTIVERSION
void mark_row(int width, const std::uint8_t* __restrict label, const float* __restrict range, float min_range_m,
              float max_range_m, int phase, std::uint8_t* __restrict enters) {
    for (int c = 0; c < width; ++c) {
        const bool is_static = (label[c] == static_cast<std::uint8_t>(PixelLabel::kStatic)) |
                               (label[c] == static_cast<std::uint8_t>(PixelLabel::kGround));
        const bool in_range = (range[c] >= min_range_m) & (range[c] <= max_range_m);
        const int skipped =
            (range[c] < kNearest_m ? 4 : 0) | (range[c] < kNear_m ? 2 : 0) | (range[c] < kMiddle_m ? 1 : 0);
        enters[c] = static_cast<std::uint8_t>(is_static & in_range & (((c + phase) & skipped) == 0));
    }
}

/// out = T p for the points of `pixel`. @param T row-major 3 x 4
DLOD_MULTIVERSION
void place_points(std::size_t count, const PixelIndex* __restrict pixel, const float* __restrict x,
                  const float* __restrict y, const float* __restrict z, const float* __restrict T,
                  float* __restrict out_x, float* __restrict out_y, float* __restrict out_z) {
    for (std::size_t i = 0; i < count; ++i) {
        const float px = x[pixel[i]];
        const float py = y[pixel[i]];
        const float pz = z[pixel[i]];
        out_x[i] = T[0] * px + T[1] * py + T[2] * pz + T[3];
        out_y[i] = T[4] * px + T[5] * py + T[6] * pz + T[7];
        out_z[i] = T[8] * px + T[9] * py + T[10] * pz + T[11];
    }
}

/// A moving object, seen in this frame, that is too large to be seen as one.
bool is_seen_in_pieces(const Track& track) {
    return track.state == DynamicState::kDynamic && track.points > 0 && track.box.longest_m() >= kSeenInPieces_m;
}

/// Where the pieces of such an object are.
OrientedBox box_of_pieces(const Track& track) {
    OrientedBox box = track.box;
    const Eigen::Vector2d along(std::cos(box.yaw_rad), std::sin(box.yaw_rad));
    const Eigen::Vector2d velocity = track.velocity_mps.head<2>();
    if (velocity.norm() > kDriving_mps && std::abs(along.dot(velocity)) > kAhead * velocity.norm()) {
        box.size_m.x() += kMayFollow_m;
        box.center_m.head<2>() -= 0.5 * kMayFollow_m * velocity.normalized();
    }
    box.size_m += Eigen::Vector3d(2.0 * kPieceMargin_m, 2.0 * kPieceMargin_m, kPieceMargin_m - kGroundClearance_m);
    box.center_m.z() += 0.5 * (kPieceMargin_m + kGroundClearance_m);
    return box;
}

/// Marks the points that lie in a box.
DLOD_MULTIVERSION
void mark_inside(std::size_t count, const float* __restrict x, const float* __restrict y, const float* __restrict z,
                 const PreparedBox box, std::uint8_t* __restrict inside) {
    for (std::size_t i = 0; i < count; ++i) inside[i] |= static_cast<std::uint8_t>(box.contains(x[i], y[i], z[i]));
}

}  // namespace

struct GlobalMap::State {
    State(const SensorModel& model, const GlobalMapConfig& map)
        : sensor(model),
          config(map),
          rule(rule_of(map)),
          cells(map.cell_m, rule),
          waiting(static_cast<std::size_t>(map.delay_frames) + 1) {
        // As large as it may become, once and for all.
        for (Postponed& p : waiting) {
            p.points.resize(selected_capacity());
            p.points.resize(0);
        }
        selected.resize(selected_capacity());
        inside.reserve(selected_capacity());
        enters.resize(static_cast<std::size_t>(sensor.width));
    }

    /// Pixels of a frame that are looked at, and one beyond them.
    std::size_t selected_capacity() const {
        return (static_cast<std::size_t>(sensor.height) + kRowStep - 1) / kRowStep *
                   static_cast<std::size_t>(sensor.width) +
               1;
    }
    void postpone(const Frame& frame, Postponed& out);
    std::size_t select(const Frame& frame);
    void leave_out_pieces(const std::vector<Track>& tracks, MapPoints& points);
    void leave_out(std::int64_t stamp_ns);
    void enter(Postponed& postponed);
    void clear_some(std::size_t budget);
    void sweep_unconfirmed();
    void forget_farthest();

    SensorModel sensor;
    GlobalMapConfig config;
    Persistence::Rule rule;
    CellTable cells;
    std::vector<Postponed> waiting;      ///< ring over the frames
    AlignedVector<PixelIndex> selected;  ///< pixels of the frame at hand that enter
    AlignedVector<std::uint8_t> enters;  ///< of the row at hand
    AlignedVector<std::uint8_t> inside;  ///< of the points at hand: 1 in the box of a moving object
    std::uint64_t frames = 0;
    std::int64_t last_stamp_ns = 0;
    std::int64_t time_ns = 0;          ///< time that has passed, whatever the sensor's clock did
    std::int64_t entered_time_ns = 0;  ///< of the frame that entered last
    std::size_t sweep_slot = 0;
    std::vector<OrientedBox> to_clear;
    Eigen::Vector3d position_m = Eigen::Vector3d::Zero();
};

GlobalMap::GlobalMap(const SensorModel& sensor, const GlobalMapConfig& config)
    : state_(std::make_unique<State>(sensor, config)) {}
GlobalMap::~GlobalMap() = default;

void GlobalMap::update(const Frame& frame) {
    State& s = *state_;
    if (frame.odometry.void_scan_ns) s.leave_out(*frame.odometry.void_scan_ns);
    Postponed& slot = s.waiting[s.frames++ % s.waiting.size()];
    s.enter(slot);  // what came delay_frames + 1 frames ago
    s.postpone(frame, slot);
    s.clear_some(kClearedCellsAFrame);
    s.sweep_unconfirmed();
    if (s.cells.size() > static_cast<std::size_t>(s.config.max_points)) s.forget_farthest();
}

void GlobalMap::finish() {
    State& s = *state_;
    for (std::size_t i = 0; i < s.waiting.size(); ++i) s.enter(s.waiting[(s.frames + i) % s.waiting.size()]);
    while (!s.to_clear.empty()) s.clear_some(kClearedCellsAFrame);
    if (s.cells.size() > static_cast<std::size_t>(s.config.max_points)) s.forget_farthest();
}

std::vector<CellTable::Entry> GlobalMap::snapshot() const {
    const State& s = *state_;
    const double run_ds = static_cast<double>(s.time_ns) / static_cast<double>(kDecisecond_ns);
    const double enough_ds = std::min<double>(s.rule.confirm_ds, kConfirmShareOfRun * run_ds);
    return s.cells.entries([&](const Persistence& seen) { return seen.confirmed() || seen.span_ds() >= enough_ds; });
}

void GlobalMap::State::postpone(const Frame& frame, Postponed& out) {
    out.points.resize(0);
    out.cleared.clear();
    if (last_stamp_ns != 0)
        time_ns += std::clamp<std::int64_t>(frame.header.stamp_ns - last_stamp_ns, 0, kLongestTurn_ns);
    last_stamp_ns = frame.header.stamp_ns;
    out.time_ns = time_ns;
    out.stamp_ns = frame.header.stamp_ns;
    if (!frame.odometry.valid) return;
    position_m = frame.odometry.T_world_sensor.translation();
    out.cleared.assign(frame.detection.cleared.begin(), frame.detection.cleared.end());
    const std::size_t count = select(frame);
    out.points.resize(count);
    float T_world_sensor[12];
    for (int i = 0; i < 12; ++i) {
        T_world_sensor[i] = static_cast<float>(frame.odometry.T_world_sensor.matrix()(i / 4, i % 4));
    }
    place_points(count, selected.data(), frame.odometry.x.data(), frame.odometry.y.data(), frame.odometry.z.data(),
                 T_world_sensor, out.points.x.data(), out.points.y.data(), out.points.z.data());
    leave_out_pieces(frame.detection.tracks, out.points);
}

void GlobalMap::State::leave_out_pieces(const std::vector<Track>& tracks, MapPoints& points) {
    bool any = false;
    for (const Track& track : tracks) {
        if (!is_seen_in_pieces(track)) continue;
        if (!any) inside.assign(points.size(), 0);
        any = true;
        mark_inside(points.size(), points.x.data(), points.y.data(), points.z.data(), PreparedBox(box_of_pieces(track)),
                    inside.data());
    }
    if (!any) return;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        points.x[kept] = points.x[i];
        points.y[kept] = points.y[i];
        points.z[kept] = points.z[i];
        kept += inside[i] == 0 ? 1 : 0;
    }
    points.resize(kept);
}

// Every fourth row, another one each time, so that four frames see all; of near surfaces, which fill many pixels of a
// row, fewer. Fills `selected` and returns how many they are.
std::size_t GlobalMap::State::select(const Frame& frame) {
    const auto min_range = static_cast<float>(config.min_range_m);
    const auto max_range = static_cast<float>(config.max_range_m);
    const auto width = static_cast<std::size_t>(sensor.width);
    // Of each four rows the first, third, second, fourth: not next to the one just seen.
    const std::size_t first_row = (frames & 1U) * 2 + (frames >> 1U & 1U);
    PixelIndex* const out = selected.data();
    std::size_t count = 0;
    for (std::size_t r = first_row; r < static_cast<std::size_t>(sensor.height); r += kRowStep) {
        const int row = static_cast<int>(r);
        mark_row(sensor.width, frame.detection.label.row(row), frame.cloud.range_m.row(row), min_range, max_range,
                 static_cast<int>((frames / kRowStep + r / kRowStep) % 8), enters.data());
        for (std::size_t c = 0; c < width; ++c) {
            out[count] = static_cast<PixelIndex>(r * width + c);
            count += enters[c];
        }
    }
    return count;
}

/// The points of the frame of that stamp, if they still wait.
void GlobalMap::State::leave_out(std::int64_t stamp_ns) {
    for (Postponed& p : waiting) {
        if (p.stamp_ns == stamp_ns) p.points.resize(0);
    }
}

void GlobalMap::State::enter(Postponed& postponed) {
    entered_time_ns = postponed.time_ns;
    cells.insert(postponed.points, deciseconds(postponed.time_ns));
    // Everything that was seen before the object turned dynamic has entered by now.
    to_clear.insert(to_clear.end(), postponed.cleared.begin(), postponed.cleared.end());
    postponed.points.resize(0);
    postponed.cleared.clear();
}

void GlobalMap::State::clear_some(std::size_t budget) {
    std::size_t done = 0;
    std::size_t visited = 0;
    for (; done < to_clear.size() && visited < budget; ++done) {
        const OrientedBox& box = to_clear[done];
        const double c = std::abs(std::cos(box.yaw_rad)), s = std::abs(std::sin(box.yaw_rad));
        const Eigen::Vector3d reach = 0.5 * Eigen::Vector3d(c * box.size_m.x() + s * box.size_m.y(),
                                                            s * box.size_m.x() + c * box.size_m.y(), box.size_m.z());
        const Eigen::Vector3d low = box.center_m - reach, high = box.center_m + reach;
        const CellTable::Index first = cells.index_of(low.x(), low.y(), low.z());
        const CellTable::Index last = cells.index_of(high.x(), high.y(), high.z());
        for (std::int32_t x = first.x; x <= last.x; ++x) {
            for (std::int32_t y = first.y; y <= last.y; ++y) {
                for (std::int32_t z = first.z; z <= last.z; ++z, ++visited) {
                    const MapPoint* p = cells.find({x, y, z});
                    if (p != nullptr && box.contains(Eigen::Vector3d(p->x, p->y, p->z))) cells.erase({x, y, z});
                }
            }
        }
    }
    to_clear.erase(to_clear.begin(), to_clear.begin() + static_cast<std::ptrdiff_t>(done));
}

// A part of the table a frame: what was seen for a moment only does not fill the memory.
void GlobalMap::State::sweep_unconfirmed() {
    const std::uint16_t now_ds = deciseconds(time_ns);
    // Points wait before they enter: what is being seen now is not forgotten meanwhile.
    const auto stale_ds = static_cast<std::uint16_t>(rule.gap_ds + deciseconds(time_ns - entered_time_ns));
    for (std::size_t i = 0; i < kSweptSlotsAFrame; ++i) {
        if (++sweep_slot >= cells.slots()) sweep_slot = 0;
        const MapPoint* p = cells.at(sweep_slot);
        if (p == nullptr || cells.seen(sweep_slot).confirmed()) continue;
        if (cells.seen(sweep_slot).since_last(now_ds) > stale_ds) cells.erase(cells.index_of(p->x, p->y, p->z));
    }
}

void GlobalMap::State::forget_farthest() {
    const auto distance2 = [&](const MapPoint& p) {
        return (Eigen::Vector3d(p.x, p.y, p.z) - position_m).squaredNorm();
    };
    std::vector<double> distances;
    distances.reserve(cells.size());
    for (std::size_t slot = 0; slot < cells.slots(); ++slot) {
        if (const MapPoint* p = cells.at(slot)) distances.push_back(distance2(*p));
    }
    const auto keep = static_cast<std::ptrdiff_t>((1.0 - kForgottenShare) * config.max_points);
    std::nth_element(distances.begin(), distances.begin() + keep, distances.end());
    const double bound = distances[static_cast<std::size_t>(keep)];
    cells.retain([&](const MapPoint& p) { return distance2(p) < bound; });
}

}  // namespace dlod
