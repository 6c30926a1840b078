// Parts of a segment that free-space evidence singles out: a person who touches a wall, an object within clutter.
#pragma once

#include <span>
#include <vector>

#include "core/evidence/evidence_image.hpp"
#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct MovingPartsConfig {
    double reach_m = 0.3;
    int min_points = 6;
    double min_height_m = 0.15;
    double min_carved_height_m = 0.4;
    double min_carved_breadth_m = 0.25;
    int small_segment = 80;
    double min_free_share = 0.3;

    template <class V>
    void visit(V& v) {
        v.parameter("reach_m", reach_m, Range{0.01, 2.0}, "m",
                    "pixels without evidence join a moving part within this distance");
        v.parameter("min_points", min_points, Range{1, 1000}, "pixels", "smaller parts are noise");
        v.parameter("min_height_m", min_height_m, Range{0.0, 2.0}, "m",
                    "flatter parts are noise: thin plates lie between the beams in some frames");
        v.parameter("min_carved_height_m", min_carved_height_m, Range{0.0, 2.0}, "m",
                    "likewise of parts of larger segments: what moves there is at least so tall");
        v.parameter("min_carved_breadth_m", min_carved_breadth_m, Range{0.0, 2.0}, "m",
                    "narrower parts of larger segments are the inner sides of edges that come into view");
        v.parameter("small_segment", small_segment, Range{1, 10000}, "pixels",
                    "segments of more pixels are larger ones");
        v.parameter("min_free_share", min_free_share, Range{0.0, 1.0}, "1",
                    "share of a part's pixels that must lie where it was free");
    }
};

class MovingParts {
  public:
    MovingParts(const SensorModel& sensor, const MovingPartsConfig& config);

    /// Requests tests of the segment's pixels around those that were found free.
    void request_around(const Frame& frame, const Segment& segment, EvidenceImage& evidence) const;

    /// Connected parts of the segment around free pixels, without those that were occupied. Calls part(pixels) for each
    /// and at last rest(pixels) for what is left.
    template <class F, class G>
    void find(const Frame& frame, const Segment& segment, const EvidenceImage& evidence, F&& part, G&& rest) {
        for (const PixelIndex seed : pixels_of(frame, segment)) {
            if (!starts(evidence, seed) || !grow(frame, segment, evidence, seed)) continue;
            for (const PixelIndex pixel : part_) state_[pixel] = kInPart;
            part(std::span<const PixelIndex>(part_));
        }
        part_.clear();
        for (const PixelIndex pixel : pixels_of(frame, segment)) {
            if (state_[pixel] != kInPart) part_.push_back(pixel);
        }
        rest(std::span<const PixelIndex>(part_));
    }
    /// Starts a frame.
    void begin() { state_.fill(kFresh); }
    /// Pixels that belong to a part already.
    void take(std::span<const PixelIndex> pixels) {
        for (const PixelIndex pixel : pixels) state_[pixel] = kInPart;
    }

  private:
    static std::span<const PixelIndex> pixels_of(const Frame& frame, const Segment& segment) {
        return std::span(frame.prepared.pixels).subspan(segment.first, segment.count);
    }
    bool starts(const EvidenceImage& evidence, PixelIndex pixel) const {
        return state_[pixel] == kFresh && evidence[pixel] == Evidence::kFree;
    }
    bool grow(const Frame& frame, const Segment& segment, const EvidenceImage& evidence, PixelIndex seed);

    SensorModel sensor_;
    MovingPartsConfig config_;
    static constexpr std::uint8_t kFresh = 0;
    static constexpr std::uint8_t kVisited = 1;
    static constexpr std::uint8_t kInPart = 2;
    Image<std::uint8_t> state_;
    std::vector<PixelIndex> part_;
    std::vector<float> away_m_;  ///< of each of part_: way from the last free pixel
};

}  // namespace dlod
