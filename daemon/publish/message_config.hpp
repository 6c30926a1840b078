// Tunables of the messages.
#pragma once

#include <string>

#include "core/types/parameter.hpp"

namespace dlod::daemon {

struct ObstaclesConfig {
    int every_frames = 0;
    double radius_m = 10.0;
    double voxel_m = 0.2;
    double min_height_m = -2.0;
    double max_height_m = 2.0;

    template <class V>
    void visit(V& v) {
        v.parameter("every_frames", every_frames, Range{0, 1000}, "frames", "a message every so many frames; 0: none");
        v.parameter("radius_m", radius_m, Range{0.5, 200.0}, "m",
                    "horizontal distance from the base up to which points are obstacles");
        v.parameter("voxel_m", voxel_m, Range{0.02, 5.0}, "m",
                    "one point is sent a voxel of this side; higher: coarser, and more of the radius fits in");
        v.parameter("min_height_m", min_height_m, Range{-100.0, 100.0}, "m",
                    "height above the base's origin from which points are obstacles");
        v.parameter("max_height_m", max_height_m, Range{-100.0, 100.0}, "m", "and up to which they are");
    }
};

struct LcmConfig {
    std::string url;
    std::string channel_prefix = "DLOD_";
    int utime_source = 0;
    bool commands = true;
    std::string bot_core_channel;
    int predicted_pose_every = 0;
    ObstaclesConfig obstacles;

    template <class V>
    void visit(V& v) {
        v.text("url", url,
               "LCM provider, say udpm://239.255.76.67:7667?ttl=1; none: publish nothing; empty: none in replay, LCM's "
               "default live");
        v.text("channel_prefix", channel_prefix,
               "put before POSE, POSE_PREDICTED, MASK, TRACKS, STATUS, SENSOR, OBSTACLES and COMMAND");
        v.choice("utime_source", utime_source, {"host", "sensor"},
                 "host: utime is host time (UTC) when live; sensor: the packets' own time");
        v.flag("commands", commands, "carry out what comes on the channel COMMAND; off: nothing is listened to");
        v.text(
            "bot_core_channel", bot_core_channel,
            "channel on which poses are published as bot_core.pose_t too, say POSE; the prefix is not put before it; "
            "empty: none");
        v.parameter("predicted_pose_every", predicted_pose_every, Range{0, 1000}, "IMU readings",
                    "live and with replay --rate: a message POSE_PREDICTED every so many readings of the IMU, with the "
                    "last pose carried on to then; 0: none");
        v.group("obstacles", obstacles, "points that are not ground, for planners that do not read packets");
    }
};

}  // namespace dlod::daemon
