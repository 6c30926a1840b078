// Plates that turn about an upright axis: doors, gates, signs.
//
// A leaf that begins to swing has moved by centimetres at its free end and not at all at its hinge: point by point that
// is noise, and where it swings away nobody can have seen its new place free. But it was a plane, and is one, and the
// angle between the two is known to milliradians. What lies in the plane from the axis to the free end is one rigid
// body.
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "core/evidence/evidence_image.hpp"
#include "core/evidence/plate_places.hpp"
#include "core/evidence/plate_turn.hpp"
#include "core/evidence/turned_plates_config.hpp"
#include "core/projection/range_image.hpp"
#include "core/types/frame.hpp"

namespace dlod {

class TurnedPlates {
  public:
    /// @param narrow_bits as of ReferenceImages
    TurnedPlates(const SensorModel& sensor, const TurnedPlatesConfig& config, int narrow_bits);

    /// Starts a frame: no plates.
    void begin();
    /// Looks for places where surfaces may have shifted among the points that `evidence` has just tested, and requests
    /// tests of what is around them.
    /// @param whole of each segment: 1 where it moves as a whole, if it does
    void request(const Frame& frame, std::span<const std::uint8_t> whole, EvidenceImage& evidence) {
        places_.request(frame, whole, evidence);
    }
    /// Finds the plates among the points that were tested upon the request.
    void find(const Frame& frame, const EvidenceImage& evidence);

    std::size_t size() const { return ends_.size(); }
    std::span<const PixelIndex> operator[](std::size_t plate) const {
        const std::size_t first = plate == 0 ? 0 : ends_[plate - 1];
        return std::span(pixels_).subspan(first, ends_[plate] - first);
    }

  private:
    void collect(const Frame& frame, const EvidenceImage& evidence, const PlatePlace& place);
    std::optional<PlateTurn> find_plate(const Frame& frame, const EvidenceImage& evidence, const PlatePlace& place,
                                        std::size_t reference);
    bool is_gone(const Frame& frame, const EvidenceImage& evidence, const PlatePlace& place, const PlateTurn& turn,
                 std::size_t reference);
    bool goes_on(const PlateTurn& turn) const;
    double shift_m(const PlateTurn& turn, std::size_t reference) const;
    void set_heights(PlateTurn& turn);
    void fill(const Frame& frame, const PlatePlace& place, const PlateTurn& turn);

    SensorModel sensor_;
    TurnedPlatesConfig config_;
    SensorProjection projection_;
    int narrow_bits_;
    PlatePlaces places_;
    PlateTurnFit turn_fit_;
    Image<std::uint8_t> taken_;       ///< 1: belongs to a plate
    std::vector<PlatePoint> points_;  ///< of the place that is looked at
    std::vector<const PlatePoint*> looks_;
    std::vector<double> sorted_;
    std::vector<PixelIndex> pixels_;
    std::vector<std::size_t> ends_;
};

}  // namespace dlod
