// Plates that turn about an upright axis: doors, gates, signs.
//
// A leaf that begins to swing has moved by centimetres at its free end and not at all at its hinge: point by point that
// is noise, and where it swings away nobody can have seen its new place free. But it was a plane, and is one, and the
// angle between the two is known to milliradians. What lies in the plane from the axis to the free end is one rigid
// body.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "core/evidence/evidence_image.hpp"
#include "core/projection/range_image.hpp"
#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct TurnedPlatesConfig {
    double min_turn_rad = 0.02;
    double max_turn_rad = 0.8;
    double min_shift_m = 0.03;
    double max_shift_m = 1.0;
    double tolerance_m = 0.03;
    double min_height_m = 0.4;
    double min_length_m = 0.2;
    double max_length_m = 5.0;

    template <class V>
    void visit(V& v) {
        v.parameter("min_turn_rad", min_turn_rad, Range{0.001, 1.0}, "rad",
                    "a plane has turned if its direction has changed by more than this, and than its uncertainty");
        v.parameter("max_turn_rad", max_turn_rad, Range{0.01, 1.5}, "rad",
                    "a direction that has changed by more within two frames is that of another plane");
        v.parameter("min_shift_m", min_shift_m, Range{0.005, 1.0}, "m", "and its free end has moved by more than this");
        v.parameter("max_shift_m", max_shift_m, Range{0.01, 5.0}, "m",
                    "what was seen so much nearer or farther was something else");
        v.parameter("tolerance_m", tolerance_m, Range{0.005, 0.5}, "m",
                    "points within this distance of a plane belong to it");
        v.parameter("min_height_m", min_height_m, Range{0.05, 5.0}, "m", "lower plates are not looked for");
        v.parameter("min_length_m", min_length_m, Range{0.05, 5.0}, "m", "shorter ones neither");
        v.parameter("max_length_m", max_length_m, Range{0.1, 50.0}, "m",
                    "nor longer ones: a wall seems to turn where the pose is wrong");
    }
};

class TurnedPlates {
  public:
    /// @param narrow_bits as of ReferenceImages
    TurnedPlates(const SensorModel& sensor, const TurnedPlatesConfig& config, int narrow_bits);

    /// Starts a frame: no plates.
    void begin();
    /// Looks for places where surfaces may have shifted among the points that `evidence` has just tested, and requests
    /// tests of what is around them.
    /// @param whole of each segment: 1 where it moves as a whole, if it does
    void request(const Frame& frame, std::span<const std::uint8_t> whole, EvidenceImage& evidence);
    /// Finds the plates among the points that were tested upon the request.
    void find(const Frame& frame, const EvidenceImage& evidence);

    std::size_t size() const { return ends_.size(); }
    std::span<const PixelIndex> operator[](std::size_t plate) const {
        const std::size_t first = plate == 0 ? 0 : ends_[plate - 1];
        return std::span(pixels_).subspan(first, ends_[plate] - first);
    }

  private:
    /// Of points in the ground plane, world axes about the sensor.
    struct Line {
        Eigen::Vector2d middle = Eigen::Vector2d::Zero();
        Eigen::Vector2d along = Eigen::Vector2d::UnitX();
        double spread_m = 0.0;  ///< standard deviation along it
        double noise_m = 0.0;   ///< and across
        int points = 0;

        Eigen::Vector2d normal() const { return {-along.y(), along.x()}; }
        double across(const Eigen::Vector2d& p) const { return normal().dot(p - middle); }
        double at(const Eigen::Vector2d& p) const { return along.dot(p - middle); }
    };
    /// A point that lies outside of what was seen around it.
    struct Seed {
        std::uint32_t segment;
        int side;  ///< -1 nearer, 1 farther
        int column, row;
        Eigen::Vector3d point;
        Eigen::Vector2d before;  ///< what was seen in its direction
    };
    /// Where a plate is looked for.
    struct Place {
        std::uint32_t label;
        int side;  ///< of the seeds
        int first_column, columns, first_row, rows;
        double low_m, high_m;  ///< of the seeds' heights
        Line line;
        double from_m, to_m;  ///< the seeds along it
    };
    struct Point {
        Eigen::Vector3d now;
        std::array<Eigen::Vector3d, CandidatePoints::kShifts> before;  ///< what the references saw in its direction
        std::array<bool, CandidatePoints::kShifts> known;
    };
    /// A plane that has turned.
    struct Turn {
        Line now, before;
        double turn_rad = 0.0;
        double hinge_m = 0.0;             ///< along `now`
        double from_m = 0.0, to_m = 0.0;  ///< extent along `now`
        double low_m = 0.0, high_m = 0.0;
    };

    template <class Use>
    Line fit(const Line& start, Use use) const;
    void add_place(std::span<const Seed> seeds, const Frame& frame, EvidenceImage& evidence);
    void collect(const Frame& frame, const EvidenceImage& evidence, const Place& place);
    Line most_common_line(const Line& start, double length_m) const;
    bool find_turn(const Place& place, std::size_t reference, Turn& turn);
    static double far_shift_m(double from_m, double to_m, const Turn& turn);
    bool has_turned(const Turn& turn) const;
    bool is_far_from_axis(const Turn& turn, const Point& p) const;
    bool is_gone(const Frame& frame, const EvidenceImage& evidence, const Place& place, const Turn& turn,
                 std::size_t reference);
    double shift_m(const Turn& turn, std::size_t reference) const;
    void set_heights(Turn& turn);
    void fill(const Frame& frame, const Place& place, const Turn& turn);

    SensorModel sensor_;
    TurnedPlatesConfig config_;
    SensorProjection projection_;
    int narrow_bits_;
    Image<std::uint8_t> taken_;  ///< 1: belongs to a plate
    std::vector<Seed> seeds_;
    std::vector<Place> places_;
    std::vector<Point> points_;
    std::vector<Eigen::Vector2d> formers_;
    std::vector<const Point*> looks_;
    std::vector<double> sorted_;
    std::vector<PixelIndex> pixels_;
    std::vector<std::size_t> ends_;
};

}  // namespace dlod
