#include "core/evidence/evidence_image.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace dlod {
namespace {

constexpr float kThinStep_m = 0.15F;
constexpr float kThinStepPerMetre = 0.02F;
// A requested pixel counts as unknown until run() has tested it.
constexpr auto kRequested = static_cast<std::uint8_t>(Evidence::kUnknown);

/// Free where some reference is sure of it and not many more object, or where what stands there has come from nearer,
/// for more references where it came by less than two surfaces can be told apart; occupied where they object for long
/// enough.
Evidence judge(const CandidatePoints& points, std::size_t i) {
    const float enough = points.occupied[i] >= 1.0F ? 3.0F : 2.0F;
    const bool receded = points.gone[i] >= enough && points.slowest[i] <= points.fastest[i];
    if (receded || (points.free[i] >= 1.0F && points.occupied[i] <= points.free[i] + 1.0F)) return Evidence::kFree;
    // What has gone by less than surfaces can be told apart need not be what was there; leaves seem to come, too.
    const bool shifted = points.gone[i] >= 2.0F && points.came[i] == 0.0F;
    if (points.occupied[i] < 1.0F || shifted) return Evidence::kUnknown;
    return points.surface[i] >= 1.0F ? Evidence::kOccupied : Evidence::kEdge;
}

/// A return that no neighbour above or below, or none to both sides, is near to: a plate or wire thinner than the beams
/// are apart, which some frames see and others miss, or a beam that met two surfaces and measured neither.
bool is_thin(const Image<float>& range_m, PixelIndex pixel) {
    const auto width = static_cast<PixelIndex>(range_m.width());
    const auto size = static_cast<PixelIndex>(range_m.size());
    const PixelIndex column = pixel % width;
    const float own = range_m[pixel];
    const float step = kThinStep_m + kThinStepPerMetre * own;
    const auto apart = [&](PixelIndex other) { return other >= size || std::abs(range_m[other] - own) > step; };
    return (apart(pixel - width) && apart(pixel + width)) ||
           (apart(column == 0 ? pixel + width - 1 : pixel - 1) &&
            apart(column + 1 == width ? pixel + 1 - width : pixel + 1));
}

}  // namespace

EvidenceImage::EvidenceImage(const SensorModel& sensor, const FreeSpaceConfig& config)
    : references_(sensor, config.octaves),
      free_space_(sensor, config, references_.narrow_bits(), references_.wide_bits()),
      image_(sensor.height, sensor.width, 0) {
    requested_.reserve(sensor.pixels());
    for (int r = 0; r < sensor.height; ++r) {
        for (int c = 0; c < sensor.width; ++c)
            block_of_.push_back(static_cast<std::uint8_t>(c * Reference::kBlocks / sensor.width));
    }
    points_.block_end.assign(Reference::kBlocks, 0);
}

void EvidenceImage::begin(const Frame& frame) {
    image_.fill(0);
    requested_.clear();
    points_.pixel.clear();
    selected_ = references_.select();
    now_ = &references_.insert(frame);
}

void EvidenceImage::request(PixelIndex pixel) {
    if (image_[pixel] != 0) return;
    image_[pixel] = kRequested;
    requested_.push_back(pixel);
}

void EvidenceImage::sort_into_blocks(const OdometryResult& odometry) {
    std::fill(points_.block_end.begin(), points_.block_end.end(), 0);
    for (const PixelIndex pixel : requested_) ++points_.block_end[block_of_[pixel]];
    std::uint32_t sum = 0;
    for (std::uint32_t& end : points_.block_end) {
        const std::uint32_t count = end;
        end = sum;
        sum += count;
    }
    points_.pixel.resize(sum);
    for (auto* v : {&points_.x, &points_.y, &points_.z}) v->resize(sum);
    for (const PixelIndex pixel : requested_) {
        const std::uint32_t i = points_.block_end[block_of_[pixel]]++;
        points_.pixel[i] = pixel;
        points_.x[i] = odometry.x[pixel];
        points_.y[i] = odometry.y[pixel];
        points_.z[i] = odometry.z[pixel];
    }
}

EvidenceImage::Counts EvidenceImage::count(std::span<const PixelIndex> pixels) const {
    // What an image can hold of them fits side by side in one word, but for the edges, which are few: counted apart.
    constexpr int kBits = 21;
    constexpr std::uint64_t kUnknown = 1, kFree = kUnknown << kBits, kOccupied = kFree << kBits, kMask = kFree - 1;
    constexpr std::array<std::uint64_t, 5> kAdd{0, kUnknown, kFree, kOccupied, kOccupied};  // by Evidence
    std::uint64_t sum = 0;
    int edges = 0;
    for (const PixelIndex pixel : pixels) {
        sum += kAdd[image_[pixel]];
        edges += (*this)[pixel] == Evidence::kEdge ? 1 : 0;
    }
    return {static_cast<int>(sum >> kBits & kMask), static_cast<int>(sum >> (2 * kBits)), static_cast<int>(sum & kMask),
            edges};
}

void EvidenceImage::run(const Frame& frame) {
    sort_into_blocks(frame.odometry);
    requested_.clear();
    free_space_.test(frame, selected_, *now_, points_);
    for (std::size_t i = 0; i < points_.size(); ++i) {
        const PixelIndex pixel = points_.pixel[i];
        const Evidence evidence = judge(points_, i);
        set(pixel, evidence == Evidence::kFree && is_thin(frame.cloud.range_m, pixel) ? Evidence::kUnknown : evidence);
    }
}

}  // namespace dlod
