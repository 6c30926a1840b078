// All tunables of the method.
#pragma once

#include "core/evidence/detection.hpp"
#include "core/map/global_map.hpp"
#include "core/odometry/odometry.hpp"
#include "core/preprocess/subsampling.hpp"
#include "core/removal/dynamic_points_removal.hpp"
#include "core/segmentation/ground_removal.hpp"
#include "core/segmentation/range_image_segmentation.hpp"
#include "core/tracking/tracker.hpp"

namespace dlod {

struct MethodConfig {
    SubsamplingConfig subsampling;
    GroundRemovalConfig ground;
    SegmentationConfig segmentation;
    OdometryConfig odometry;
    DetectionConfig detection;
    TrackingConfig tracking;
    RemovalConfig removal;
    GlobalMapConfig map;
    bool handle_dynamic_objects = true;

    template <class V>
    void visit(V& v) {
        v.flag("handle_dynamic_objects", handle_dynamic_objects, "off: plain two-stage odometry, every point enters the maps");
        v.group("subsampling", subsampling, "which pixels go to the registration");
        v.group("ground", ground, "ground removal on the range image");
        v.group("segmentation", segmentation, "clustering of the range image into segments");
        v.group("odometry", odometry, "two-stage registration, motion model, local map");
        v.group("detection", detection, "cues that single out moving objects");
        v.group("tracking", tracking, "association, filters, dynamic state");
        v.group("removal", removal, "labels, keyframes without moving objects, clearing of the past");
        v.group("map", map, "global map");
    }
};

}  // namespace dlod
