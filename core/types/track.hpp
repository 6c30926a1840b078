// Segments, detections and tracks as they pass between segmentation, evidence, tracking and removal.
#pragma once

#include "core/types/image.hpp"
#include "core/types/oriented_box.hpp"

#include <Eigen/Core>

#include <cstdint>
#include <vector>

namespace dlod {

/// Dynamic state of a track (paper, Sec. "Dynamic State Update").
enum class DynamicState : std::uint8_t { kUndefined = 0, kStatic = 1, kDynamic = 2 };

/// What labels.bin holds for a pixel (formats.md).
enum class PixelLabel : std::uint8_t { kNoReturn = 0, kStatic = 1, kDynamic = 2, kUndecided = 3, kGround = 4 };

/// A cluster of pixels of one frame, from the range image alone (paper, Sec. "Range Image-based Segmentation").
struct Segment {
    std::uint32_t first = 0;  ///< its pixels are pixels[first .. first + count) of the frame's segmentation
    std::uint32_t count = 0;
    std::uint16_t rows = 0;   ///< number of image rows that it touches
    Eigen::Vector3f min_m = Eigen::Vector3f::Zero();  ///< bounds in the sensor frame, not deskewed
    Eigen::Vector3f max_m = Eigen::Vector3f::Zero();
    float length_m = 0.0F;    ///< greatest horizontal extent, over four directions 45 degrees apart
    float max_range_m = 0.0F;
    bool feasible = false;    ///< passed the feasibility rules: may be an object
};

/// A candidate object of one frame: a feasible segment, or the part of one that evidence has singled out.
struct Detection {
    std::uint32_t segment = 0;  ///< index of the segment that it comes from
    std::uint32_t first = 0;  ///< its pixels are pixels[first .. first + count) of DetectionResult
    std::uint32_t count = 0;
    OrientedBox box;                  ///< world frame, of the visible points
    Eigen::Vector3d centroid_m = Eigen::Vector3d::Zero();  ///< world frame
    double height_m = 0.0;            ///< h_S: range of z of its points (Eq. 6)
    double average_residual_m = 0.0;  ///< Algorithm 1; 0 where no pixel has a residual
    int residual_points = 0;          ///< pixels that had one
    // Free-space evidence: how many of its tested pixels lie where earlier frames confidently saw free space, where they
    // saw a surface, and where they saw nothing (unknown).
    int free_points = 0;
    int occupied_points = 0;
    int unknown_points = 0;
    int edge_points = 0;  ///< of the occupied ones: between two surfaces that were seen, on none itself
    bool turned = false;  ///< a plane that lay at another angle in two earlier frames: sure to move, by these alone
    // A nearer surface borders the detection on that side: its true extent is hidden there.
    bool occluded_left = false;
    bool occluded_right = false;
    int track = -1;                   ///< index into DetectionResult::tracks after association, -1 none
};

/// A tracked object as published and written; world frame.
struct Track {
    std::uint32_t id = 0;                 ///< from 1, never used twice in a run
    DynamicState state = DynamicState::kUndefined;
    OrientedBox box;                      ///< the whole object's estimated box at the frame's stamp
    Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
    Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();  ///< of position, then velocity
    int points = 0;                       ///< pixels in this frame, 0 when only predicted
    int hits = 0;                         ///< frames in which it was detected
    int misses = 0;                       ///< consecutive frames without a detection
    int age = 0;                          ///< frames since birth
    double residual_m = 0.0;              ///< last average residual
};

}  // namespace dlod
