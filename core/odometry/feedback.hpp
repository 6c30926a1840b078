// What detection and tracking tell the odometry, a fixed number of frames later.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <vector>

#include "core/types/image.hpp"
#include "core/types/oriented_box.hpp"

namespace dlod {

/// The feedback of frame k takes effect in the odometry of frame k + kFeedbackDelay, whatever the number of threads:
/// the stages in between may run side by side and the result is still the same to the byte.
inline constexpr int kFeedbackDelay = 2;

/// Predicted footprint of a moving object.
struct MovingBox {
    OrientedBox box;  ///< world frame, at the stamp of the frame that the feedback is of
    Eigen::Vector3d velocity_mps = Eigen::Vector3d::Zero();
};

/// Static points of a frame that becomes a keyframe, after its moving points have been removed.
struct KeyframeCloud {
    Eigen::Isometry3d T_world_sensor = Eigen::Isometry3d::Identity();
    AlignedVector<float> x, y, z;     ///< sensor frame at the stamp, deskewed, metres
    AlignedVector<float> nx, ny, nz;  ///< unit normals, same frame; 0, 0, 0 where the surface is not flat

    void clear() {
        for (auto* values : {&x, &y, &z, &nx, &ny, &nz}) values->clear();
    }
    void push(const float point[3], const float normal[3]) {
        x.push_back(point[0]);
        y.push_back(point[1]);
        z.push_back(point[2]);
        nx.push_back(normal[0]);
        ny.push_back(normal[1]);
        nz.push_back(normal[2]);
    }
};

struct OdometryFeedback {
    std::uint64_t sequence = 0;  ///< of the frame that it comes from
    std::int64_t stamp_ns = 0;
    std::vector<MovingBox> moving;  ///< points inside weigh nothing in the registration
    bool has_keyframe = false;
    KeyframeCloud keyframe;
    std::vector<OrientedBox> cleared;  ///< boxes whose points leave the odometry's own keyframes
};

}  // namespace dlod
