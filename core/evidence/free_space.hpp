// Free-space evidence: was the place of a return seen free, occupied, or not at all by earlier frames?
#pragma once

#include <array>
#include <span>

#include "core/evidence/reference_images.hpp"
#include "core/projection/range_image.hpp"
#include "core/types/frame.hpp"
#include "core/types/parameter.hpp"

namespace dlod {

struct FreeSpaceConfig {
    double margin_m = 0.12;
    double margin_per_m = 0.01;
    double occupied_tolerance_m = 0.1;
    double near_m = 2.5;
    int octaves = 6;
    double settle_s = 0.8;
    double receding_s = 1.0;
    double receding_margin_m = 0.03;
    double receding_margin_per_m = 0.01;
    double min_receding_mps = 0.15;
    double shift_margin_m = 0.02;
    double shift_margin_per_m = 0.003;

    template <class V>
    void visit(V& v) {
        v.parameter("margin_m", margin_m, Range{0.01, 2.0}, "m",
                    "an earlier frame must have seen so much farther than a point for its place to count as free; "
                    "higher is safer, slower");
        v.parameter("margin_per_m", margin_per_m, Range{0.0, 0.2}, "1",
                    "growth of that margin with range, as of the width that a direction is known to");
        v.parameter("occupied_tolerance_m", occupied_tolerance_m, Range{0.01, 1.0}, "m",
                    "an earlier return within this (plus margin_per_m) of a point makes its place occupied");
        v.parameter("near_m", near_m, Range{0.0, 50.0}, "m",
                    "nearer points are compared with a wider window, for errors of the pose");
        v.parameter("octaves", octaves, Range{1, 10}, "1",
                    "earlier frames used: the last and one in each of so many octaves of age");
        v.parameter("settle_s", settle_s, Range{0.0, 10.0}, "s",
                    "a frame so old that saw a place occupied counts fully against motion, younger ones less");
        v.parameter("receding_s", receding_s, Range{0.0, 10.0}, "s",
                    "what moves away from the sensor is looked for in so many last seconds; 0: not at all");
        v.parameter("receding_margin_m", receding_margin_m, Range{0.01, 2.0}, "m",
                    "all that was seen in a direction must have been so much nearer to count as moved away; higher is "
                    "safer, slower");
        v.parameter("receding_margin_per_m", receding_margin_per_m, Range{0.0, 0.2}, "1",
                    "growth of that margin with range, as of the width that a direction is known to");
        v.parameter("min_receding_mps", min_receding_mps, Range{0.01, 10.0}, "m/s", "slower is not told from rest");
        v.parameter("shift_margin_m", shift_margin_m, Range{0.005, 1.0}, "m",
                    "a surface may have shifted where it lies by more than this outside of all that was seen around; "
                    "lower looks at more places");
        v.parameter("shift_margin_per_m", shift_margin_per_m, Range{0.0, 0.2}, "1", "growth of that margin with range");
    }
};

/// Points to be tested, sorted by block of columns (structure of arrays).
struct CandidatePoints {
    static constexpr std::size_t kShifts = 2;
    static constexpr float kNoShift = 1e6F;

    AlignedVector<PixelIndex> pixel;
    AlignedVector<float> x, y, z;         ///< sensor frame at the stamp, deskewed
    AlignedVector<float> free, occupied;  ///< results: for how many references the place was free, and was occupied;
                                          ///< the latter weighted by age, since what moves slowly was here just before
    AlignedVector<float> surface;         ///< results: as occupied, by those that saw a surface there, not an edge
                                          ///< between a nearer and a farther one
    AlignedVector<float> gone;            ///< results: in how many references something hid the place that is gone now
    AlignedVector<float> came;            ///< results: how many recent references saw only farther surfaces there
    AlignedVector<float> slowest, fastest;  ///< speeds at which that can have moved away to here; none: it did not
    /// Results: by how much each point lies beyond the surface that the two newest references saw in its direction, by
    /// the middle of their windows; kNoShift where they saw none.
    std::array<AlignedVector<float>, kShifts> shift;
    AlignedVector<float> outside;          ///< results: by how much it lies outside of the older one's window, beyond
                                           ///< the margin; positive: farther
    std::vector<std::uint32_t> block_end;  ///< [Reference::kBlocks] end of each block's points
    std::size_t size() const { return pixel.size(); }
};

/// Compares points with references.
class FreeSpace {
  public:
    /// @param narrow_bits, wide_bits as of ReferenceImages
    FreeSpace(const SensorModel& sensor, const FreeSpaceConfig& config, int narrow_bits, int wide_bits);

    /// Fills points.free and points.occupied: what the references saw at each point.
    /// @param now the frame itself as a reference
    void test(const Frame& frame, std::span<const Reference* const> references, const Reference& now,
              CandidatePoints& points);

  private:
    /// A reference in use.
    struct Comparison {
        const Reference& reference;
        const Reference& now;
        Eigen::Isometry3f T_reference_sensor;
        float age_s;
        float occupied_weight;
        bool recent;        ///< what moves away is looked for
        std::size_t order;  ///< among the references, newest first
    };

    void test_block(const Comparison& comparison, int begin, int n, CandidatePoints& points);
    void compare_block(const Comparison& comparison, const Eigen::Isometry3f& T_column_sensor, int begin, int n,
                       CandidatePoints& points);
    void follow_receding(const Comparison& comparison, const Eigen::Isometry3f& T_column_sensor, int begin, int n,
                         CandidatePoints& points);
    std::size_t block_of(const Eigen::Vector3f& point) const;

    FreeSpaceConfig config_;
    SensorProjection projection_;
    Eigen::Isometry3f T_lidar_sensor_;
    int narrow_bits_;
    int wide_bits_;
    float mean_offset_rad_ = 0.0F;      ///< azimuth at which the mean row's column 0 looks, lidar frame
    AlignedVector<std::uint8_t> late_;  ///< [H * W] 1: fired in the second half of the sweep
    int max_shift_ = 0;
    AlignedVector<std::int32_t> pixel_;  ///< scratch of one block
    AlignedVector<float> range_;
    AlignedVector<float> gap_;            ///< by how much something nearer hid each point
    AlignedVector<float> cover_;          ///< by how much all that was seen there did
    AlignedVector<std::uint8_t> hidden_;  ///< 1: something did
    std::vector<std::int32_t> behind_;    ///< first those of the block's points of which it did
    AlignedVector<float> hider_x_, hider_y_, hider_z_, hider_range_;
    AlignedVector<std::int32_t> hider_pixel_;
};

}  // namespace dlod
