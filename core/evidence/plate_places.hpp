// Where plates that turn are looked for: around points, in a line from above, that lie outside of what was seen there.
#pragma once

#include <span>
#include <vector>

#include "core/evidence/evidence_image.hpp"
#include "core/evidence/plan_line.hpp"
#include "core/evidence/turned_plates_config.hpp"
#include "core/types/frame.hpp"

namespace dlod {

/// Of the two references that plates are compared with.
inline constexpr std::size_t kNewer = 0, kOlder = 1;
/// What lies farther from the line of a place is no part of the plate, m.
inline constexpr double kPlateReach_m = 0.1;

/// Where a plate is looked for.
struct PlatePlace {
    std::uint32_t label;
    int side;  ///< of the seeds
    int first_column, columns, first_row, rows;
    double low_m, high_m;  ///< of the seeds' heights
    PlanLine line;
    double from_m, to_m;  ///< the seeds along it
};

class PlatePlaces {
  public:
    PlatePlaces(const SensorModel& sensor, const TurnedPlatesConfig& config);

    /// Starts a frame: no places.
    void begin() { places_.clear(); }
    /// Finds the places among the points that `evidence` has just tested, and requests tests of what is around them.
    /// @param whole of each segment: 1 where it moves as a whole, if it does
    void request(const Frame& frame, std::span<const std::uint8_t> whole, EvidenceImage& evidence);

    std::span<const PlatePlace> found() const { return places_; }

  private:
    /// A point that lies outside of what was seen around it.
    struct Seed {
        std::uint32_t segment;
        int side;  ///< -1 nearer, 1 farther
        int column, row;
        Eigen::Vector3d point;
        Eigen::Vector2d before;  ///< what was seen in its direction
    };

    void add_place(std::span<const Seed> seeds, const Frame& frame, EvidenceImage& evidence);
    void request_around(const PlatePlace& place, const Frame& frame, EvidenceImage& evidence) const;

    SensorModel sensor_;
    TurnedPlatesConfig config_;
    std::vector<Seed> seeds_;
    std::vector<PlatePlace> places_;
    std::vector<Eigen::Vector2d> formers_;
};

}  // namespace dlod
