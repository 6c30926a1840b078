// Free-space evidence as an image: for the pixels that were tested, whether the place was free, occupied or unknown.
#pragma once

#include <span>

#include "core/evidence/free_space.hpp"
#include "core/evidence/reference_images.hpp"
#include "core/types/frame.hpp"

namespace dlod {

/// Edge: occupied, but no surface was seen at the place itself, only one that is nearer and another, farther one: what
/// moves away past its own outline, or stands beside it, is found there as often as what stays.
enum class Evidence : std::uint8_t { kUntested = 0, kUnknown = 1, kFree = 2, kOccupied = 3, kEdge = 4 };

inline bool is_occupied(Evidence evidence) {
    return evidence >= Evidence::kOccupied;
}

/// Chooses the pixels to test, tests them and keeps the result of one frame.
class EvidenceImage {
  public:
    EvidenceImage(const SensorModel& sensor, const FreeSpaceConfig& config);

    /// Starts a frame: nothing tested, references chosen; remembers the frame for later ones.
    void begin(const Frame& frame);
    /// Asks for a test of the pixel, once a frame; it takes place in run().
    void request(PixelIndex pixel);
    /// Tests all requested pixels.
    void run(const Frame& frame);
    /// Forgets all earlier frames: their poses no longer fit.
    void forget() { references_.clear(); }

    Evidence operator[](PixelIndex pixel) const { return static_cast<Evidence>(image_[pixel]); }
    /// Something was seen at the place, and be it an edge.
    bool was_occupied(PixelIndex pixel) const { return is_occupied((*this)[pixel]); }
    /// Tested pixels by what they say.
    struct Counts {
        int free = 0, occupied = 0, unknown = 0;
        int edges = 0;  ///< of the occupied ones
        void add(Evidence evidence) {
            (evidence == Evidence::kFree ? free : is_occupied(evidence) ? occupied : unknown) += 1;
            edges += evidence == Evidence::kEdge ? 1 : 0;
        }
    };
    Counts count(std::span<const PixelIndex> pixels) const;
    void set(PixelIndex pixel, Evidence evidence) { image_[pixel] = static_cast<std::uint8_t>(evidence); }
    /// Pixels tested by the last run().
    std::span<const PixelIndex> tested() const { return points_.pixel; }
    const CandidatePoints& points() const { return points_; }
    /// Earlier frames that were compared with, newest first, and this frame as one.
    std::span<const Reference* const> references() const { return selected_; }
    const Reference& now() const { return *now_; }
    int narrow_bits() const { return references_.narrow_bits(); }

  private:
    void sort_into_blocks(const OdometryResult& odometry);

    ReferenceImages references_;
    FreeSpace free_space_;
    std::vector<const Reference*> selected_;
    const Reference* now_ = nullptr;
    Image<std::uint8_t> image_;
    std::vector<std::uint8_t> block_of_;  ///< [H * W] block of the pixel's column
    std::vector<PixelIndex> requested_;
    CandidatePoints points_;
};

}  // namespace dlod
