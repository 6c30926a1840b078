#include "core/evidence/detection.hpp"

#include <algorithm>
#include <array>
#include <limits>

#include "core/evidence/completion.hpp"
#include "core/evidence/evidence_image.hpp"
#include "core/evidence/occlusion.hpp"

namespace dlod {

struct Detector::State {
    State(const SensorModel& sensor, const DetectionConfig& c)
        : config(c),
          residuals(sensor),
          evidence(sensor, c.free_space),
          openings(sensor, c.openings),
          parts(sensor, c.parts),
          plates(sensor, c.plates, evidence.narrow_bits()),
          completion(sensor, c.completion),
          row_ends(2 * static_cast<std::size_t>(sensor.height)) {
        counts.reserve(4096);
        divided.reserve(4096);
        whole.reserve(4096);
        completed.reserve(sensor.pixels());
    }

    void test(const Frame& frame);
    void find_plates(const Frame& frame);
    void run(const Frame& frame);
    bool is_compact(const Segment& segment) const;
    bool mixes(const Segment& segment, std::size_t s) const;
    void detect(Frame& frame);
    void add(Frame& frame, std::size_t segment, std::span<const PixelIndex> pixels);
    void complete(Frame& frame);

    DetectionConfig config;
    ResidualImage residuals;
    EvidenceImage evidence;
    FramedOpenings openings;
    MovingParts parts;
    TurnedPlates plates;
    Completion completion;
    std::vector<EvidenceImage::Counts> counts;  ///< by segment
    std::vector<std::uint8_t> divided;          ///< likewise: 1 of what only parts of move, or have turned
    std::vector<std::uint8_t> whole;            ///< likewise: 1 of what is no larger than a person
    std::vector<int> row_ends;
    std::vector<PixelIndex> completed;  ///< pixels of the completed detections, swapped with the frame's
};

/// Tests what was asked for, and counts it by segment.
void Detector::State::run(const Frame& frame) {
    evidence.run(frame);
    openings.take_back(frame, whole, evidence);
    for (const PixelIndex pixel : evidence.tested()) {
        counts[frame.prepared.segment[pixel] - 1].add(evidence[pixel]);
    }
}

bool Detector::State::is_compact(const Segment& segment) const {
    const Eigen::Vector3f size = segment.max_m - segment.min_m;
    return segment.feasible && static_cast<double>(std::max(size.x(), size.y())) <= config.compact_m;
}

/// Free and occupied places in one segment, or free ones in something that is no object: only parts of it move.
bool Detector::State::mixes(const Segment& segment, std::size_t s) const {
    constexpr int kFewest = 3;
    const EvidenceImage::Counts& c = counts[s];
    if (c.free < kFewest) return false;
    // A slow or turning object is partly where it was before: one no larger than a person stays whole unless most of it
    // was there.
    if (is_compact(segment) && 2 * c.occupied <= 5 * c.free) return false;
    return !segment.feasible || (c.occupied >= kFewest && c.occupied > config.mixed_share * (c.free + c.occupied));
}

void Detector::State::test(const Frame& frame) {
    evidence.begin(frame);
    openings.begin();
    parts.begin();
    const Preparation& prepared = frame.prepared;
    counts.assign(prepared.segments.size(), {});
    whole.assign(prepared.segments.size(), 0);
    for (std::size_t s = 0; s < prepared.segments.size(); ++s) whole[s] = is_compact(prepared.segments[s]) ? 1 : 0;
    for (const Segment& segment : prepared.segments) {
        const auto samples = static_cast<std::uint32_t>(config.samples);
        // Small leftovers may be far objects or parts of near ones: tested like objects.
        const bool coarse = !segment.feasible && segment.count > samples;
        const std::uint32_t stride =
            coarse ? static_cast<std::uint32_t>(config.background_stride) : (segment.count + samples - 1) / samples;
        for (std::uint32_t i = stride / 2; i < segment.count; i += stride) {
            const PixelIndex pixel = prepared.pixels[segment.first + i];
            if (static_cast<double>(frame.cloud.range_m[pixel]) <= config.max_range_m) evidence.request(pixel);
        }
    }
    run(frame);
    plates.begin();
    if (config.use_plates) plates.request(frame, whole, evidence);
    // Decided by what was tested evenly: what is tested around free places, too, says more of these than of the rest.
    divided.assign(prepared.segments.size(), 0);
    for (std::size_t s = 0; s < prepared.segments.size(); ++s) {
        if (!mixes(prepared.segments[s], s)) continue;
        divided[s] = 1;
        parts.request_around(frame, prepared.segments[s], evidence);
    }
    run(frame);
    if (config.use_plates) find_plates(frame);
}

/// What belongs to a plate that has turned moves, whatever its single points say.
void Detector::State::find_plates(const Frame& frame) {
    plates.find(frame, evidence);
    for (std::size_t k = 0; k < plates.size(); ++k) {
        parts.take(plates[k]);
        divided[frame.prepared.segment[plates[k].front()] - 1] = 1;
        for (const PixelIndex pixel : plates[k]) evidence.set(pixel, Evidence::kFree);
    }
}

void Detector::State::add(Frame& frame, std::size_t segment, std::span<const PixelIndex> pixels) {
    DetectionResult& result = frame.detection;
    Detection& detection = result.detections.emplace_back();
    detection.segment = static_cast<std::uint32_t>(segment);
    detection.first = static_cast<std::uint32_t>(result.pixels.size());
    detection.count = static_cast<std::uint32_t>(pixels.size());
    result.pixels.insert(result.pixels.end(), pixels.begin(), pixels.end());
    if (!config.use_free_space) return;
    const EvidenceImage::Counts counted = evidence.count(pixels);
    detection.free_points = counted.free;
    detection.occupied_points = counted.occupied;
    detection.unknown_points = counted.unknown;
    detection.edge_points = counted.edges;
}

/// Completes what may be moving and measures what needs the whole mask.
void Detector::State::complete(Frame& frame) {
    DetectionResult& result = frame.detection;
    completion.begin();
    completion.take(result.pixels);
    completed.clear();
    // Where free space is seen, it tells what moves from what stands where the submap ends; the residual alone does
    // not.
    const float cap_m = config.use_free_space ? std::numeric_limits<float>::infinity() : frame.odometry.residual_cap_m;
    for (Detection& detection : result.detections) {
        const std::size_t first = completed.size();
        const auto own = std::span(result.pixels).subspan(detection.first, detection.count);
        completed.insert(completed.end(), own.begin(), own.end());
        if (config.use_free_space && detection.free_points > detection.occupied_points) {
            completion.complete(frame, evidence, first, completed);
        }
        detection.first = static_cast<std::uint32_t>(first);
        detection.count = static_cast<std::uint32_t>(completed.size() - first);
        const auto pixels = std::span<const PixelIndex>(completed).subspan(first);
        mark_occlusion(pixels, frame.cloud.range_m, config.occlusion_step_m, row_ends, detection);
        if (!config.use_residual) continue;
        const AverageResidual residual = average_residual(pixels, residuals.image(), cap_m);
        detection.average_residual_m = residual.mean_m;
        detection.residual_points = residual.count;
    }
    result.pixels.swap(completed);
    result.motion.clear();
    if (!config.use_free_space) return;
    constexpr std::array<std::int8_t, 5> kMotion{0, 0, 1, -1, 0};  // by Evidence
    for (const PixelIndex pixel : result.pixels)
        result.motion.push_back(kMotion[static_cast<std::size_t>(evidence[pixel])]);
}

void Detector::State::detect(Frame& frame) {
    const Preparation& prepared = frame.prepared;
    for (std::size_t k = 0; k < plates.size(); ++k) {
        add(frame, prepared.segment[plates[k].front()] - 1, plates[k]);
        frame.detection.detections.back().turned = true;
    }
    for (std::size_t s = 0; s < prepared.segments.size(); ++s) {
        const Segment& segment = prepared.segments[s];
        if (config.use_free_space && divided[s] != 0) {
            const auto add_part = [&](std::span<const PixelIndex> pixels) { add(frame, s, pixels); };
            // What is left of an object may be the part of it that rests.
            parts.find(frame, segment, evidence, add_part, [&](std::span<const PixelIndex> pixels) {
                if (segment.feasible && pixels.size() >= static_cast<std::size_t>(config.parts.min_points))
                    add(frame, s, pixels);
            });
        } else if (segment.feasible && static_cast<double>(segment.max_range_m) <= config.max_range_m) {
            add(frame, s, std::span(prepared.pixels).subspan(segment.first, segment.count));
        }
    }
}

Detector::Detector(const SensorModel& sensor, const DetectionConfig& config)
    : state_(std::make_unique<State>(sensor, config)) {}
Detector::~Detector() = default;

void Detector::process(Frame& frame) {
    State& state = *state_;
    frame.detection.pixels.clear();
    frame.detection.motion.clear();
    frame.detection.detections.clear();
    state.residuals.update(frame.odometry);
    if (frame.odometry.earlier_is_void()) state.evidence.forget();
    if (!frame.odometry.follows_map()) return;
    if (state.config.use_free_space) state.test(frame);
    state.detect(frame);
    state.complete(frame);
}

const Image<float>& Detector::residual_image() const {
    return state_->residuals.image();
}

}  // namespace dlod
