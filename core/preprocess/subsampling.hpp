// Preprocessing: which pixels go to the registration, with their normals (paper, Sec. "Overview"; the reference's grid
// subsampling, crop box and minimum range).
#pragma once

#include "core/preprocess/plane_windows.hpp"
#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct SubsamplingConfig {
    int rows = 32;
    int column_step = 4;
    int points = 3000;
    int rough_points = 6000;
    int least_points = 2500;
    double spacing_m = 0.12;
    double min_range_m = 0.5;
    double crop_box_m = 0.5;
    double max_deviation_m = 0.03;
    double min_incidence = 0.08;

    template <class V>
    void visit(V& v) {
        v.parameter("rows", rows, Range{4, 512}, "rows",
                    "rows of the image that are candidates; more is slower, more accurate; where columns are missing "
                    "more rows make up for them");
        v.parameter("column_step", column_step, Range{1, 64}, "columns",
                    "every n-th of 1024 columns is a candidate; finer images have no more of them");
        v.parameter("points", points, Range{200, 50000}, "points",
                    "flat points kept, evened out over the directions of their normals");
        v.parameter("rough_points", rough_points, Range{200, 50000}, "points",
                    "points kept of what is not flat, evenly over the image; more sees smaller moving objects");
        v.parameter(
            "least_points", least_points, Range{0, 50000}, "points",
            "with fewer flat points raw ones make up for them: many columns lost, or trees and bushes, between which "
            "the ground is all that is flat");
        v.parameter("spacing_m", spacing_m, Range{0.0, 5.0}, "m",
                    "near surfaces are thinned to about this spacing along a row");
        v.parameter("min_range_m", min_range_m, Range{0.0, 10.0}, "m",
                    "nearer returns (the robot itself) are not used");
        v.parameter("crop_box_m", crop_box_m, Range{0.0, 10.0}, "m",
                    "half side of a cube around the sensor whose points are not used");
        v.parameter("max_deviation_m", max_deviation_m, Range{0.001, 0.5}, "m",
                    "a window counts as flat up to this deviation from its plane");
        v.parameter("min_incidence", min_incidence, Range{0.0, 1.0}, "",
                    "least cosine between beam and normal of a flat point");
    }
};

/// Selects the points of the registration: fills frame.prepared.points from the range image. Needs no pose.
/// Flat points come first, are smoothed over their window and carry its normal; the others are raw, with planarity 0.
/// Both are in the order of their firing.
class Subsampling {
  public:
    Subsampling(const SensorModel& sensor, const SubsamplingConfig& config);
    void process(Frame& frame);

  private:
    static constexpr int kDirections = 24;  ///< bins of normals: 2 x 2 on each face of a cube

    struct Rough {
        PixelIndex pixel;
        std::uint16_t measurement;
        std::uint16_t place() const { return measurement; }  ///< in the order of firing, columns
    };
    struct Flat {
        PixelIndex pixel;
        std::uint16_t measurement;
        std::uint16_t fired;     ///< column of the window's mean firing time
        std::uint8_t direction;  ///< bin of the normal
        std::int32_t partial;    ///< place of the window's firing in partial_; kWhole: that of its row
        float inverse_range, slope_azimuth, slope_altitude, deviation_m;  ///< as in PlaneRow
        std::uint16_t place() const { return fired; }
    };
    static constexpr std::int32_t kWhole = -1;

    int rows_of(const Frame& frame) const;
    void collect_row(const Frame& frame, int row);
    void thin_out();
    void write_flat(const Frame& frame, const Flat& candidate, PointSelection& points, std::size_t at) const;
    void select(Frame& frame);
    template <class Candidate>
    void sort_by_firing(const std::vector<Candidate>& candidates);

    SensorModel sensor_;
    SubsamplingConfig config_;
    PlaneWindows windows_;
    PlaneRow planes_;
    std::vector<Flat> flat_;
    std::vector<Rough> rough_;
    std::vector<WindowFiring> partial_;  ///< of the flat candidates of which columns are missing
    int rows_;                           ///< with candidates, of a whole frame
    int sent_columns_;                   ///< that a whole frame has
    std::vector<std::uint32_t> order_;   ///< scratch of sort_by_firing
    std::vector<std::uint32_t> next_;    ///< scratch of sort_by_firing
};

}  // namespace dlod
