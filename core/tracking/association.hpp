// Which detection belongs to which track (paper, Sec. "Tracking and Association", Eq. 5).
#pragma once

#include <span>
#include <vector>

#include "core/tracking/hungarian.hpp"
#include "core/tracking/kalman_filter.hpp"

namespace dlod {

/// A track as it is expected in this frame.
struct ExpectedTrack {
    OrientedBox visible;                   ///< last visible box, moved with the object
    OrientedBox whole;                     ///< predicted box of the whole object
    const KalmanFilter* filter = nullptr;  ///< predicted to the frame's stamp
    int points = 0;                        ///< pixels when last seen
    bool young = false;                    ///< too few detections for its velocity to be known
    bool steady = false;                   ///< seen often enough to believe in it as an object of its own
    bool established = false;              ///< seen so often that younger tracks give way
    double dt_s = 0.0;                     ///< since it was last seen
    double motion = 0.0;                   ///< belief that it moves: -1 (static) .. 1 (moving)
};

/// A detection as the association sees it.
struct CandidateDetection {
    OrientedBox visible;
    int points = 0;
    double age_s = 0.0;   ///< of its points before the frame's stamp
    double motion = 0.0;  ///< what its own evidence says: -1 (it was there before) .. 1 (it was free space before)
};

/// Assigns detections to tracks at the least cost. Pairs beyond the gate are never looked at, so that far pairs steal
/// no matches. A first pass takes overlapping boxes by the paper's cost (Eq. 5), a second one what is left by the
/// distance to the predicted position. Keeps its memory.
class Association {
  public:
    /// @param known track of each detection where it is known already, -1 where not; may be shorter
    /// @return the detection of each track, -1 for none; valid until the next call
    const std::vector<int>& solve(std::span<const ExpectedTrack> tracks, std::span<const CandidateDetection> detections,
                                  const AssociationConfig& config, std::span<const int> known = {});

    /// What the last call returned.
    const std::vector<int>& last() const { return detection_of_; }

    /// Eq. 5: alpha (1 - IoU) + beta (1 - min / max of the point counts).
    static double cost(double iou, int points_a, int points_b, const AssociationConfig& config);

  private:
    struct Pair {
        int track = 0;
        int detection = 0;
        double cost = 0.0;
    };
    /// A pair within the gate.
    struct Candidate {
        int track = 0;
        int detection = 0;
        double distance = 0.0;  ///< in units of the gate
        double iou = 0.0;
    };
    struct Place {
        double x_m, y_m, reach_m;
    };
    void set_places(std::span<const CandidateDetection> detections);
    /// Fills candidates_ with the pairs within the gate of what is not matched yet.
    void find_candidates(std::span<const ExpectedTrack> tracks, std::span<const CandidateDetection> detections,
                         const AssociationConfig& config);
    void match(int track, int detection);
    void assign(std::size_t tracks, std::size_t detections, double unmatched_cost);
    void assign_component(std::size_t first, std::size_t last, double unmatched_cost);

    Hungarian hungarian_;
    std::vector<Pair> pairs_;
    std::vector<int> detection_of_, track_of_, component_, row_of_, column_of_, rows_, columns_;
    std::vector<Candidate> candidates_;
    std::vector<Place> places_;  ///< of the detections
    std::vector<double> cost_;
};

}  // namespace dlod
