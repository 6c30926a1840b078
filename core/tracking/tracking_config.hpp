// Tunables of association, filters and dynamic state.
#pragma once

#include "core/types/parameter.hpp"

namespace dlod {

struct KalmanConfig {
    double acceleration_sd_mps2 = 2.0;
    double vertical_acceleration_sd_mps2 = 0.5;
    double yaw_rate_sd_radps = 1.0;
    double size_rate_sd_mps = 0.1;
    double birth_velocity_sd_mps = 4.0;
    double birth_vertical_velocity_sd_mps = 0.3;
    double position_sd_m = 0.06;
    double size_sd_m = 0.15;
    double min_size_m = 0.1;
    double max_speed_mps = 40.0;

    template <class V>
    void visit(V& v) {
        v.parameter("acceleration_sd_mps2", acceleration_sd_mps2, Range{0.01, 50.0}, "m/s^2",
                    "how hard objects accelerate in the ground plane; higher follows faster and smooths less");
        v.parameter("vertical_acceleration_sd_mps2", vertical_acceleration_sd_mps2, Range{0.01, 50.0}, "m/s^2",
                    "likewise, upwards");
        v.parameter("yaw_rate_sd_radps", yaw_rate_sd_radps, Range{0.01, 10.0}, "rad/s", "how fast objects turn");
        v.parameter("size_rate_sd_mps", size_rate_sd_mps, Range{0.001, 5.0}, "m/s",
                    "how fast remembered sizes follow what is seen");
        v.parameter("birth_velocity_sd_mps", birth_velocity_sd_mps, Range{0.1, 50.0}, "m/s",
                    "expected speed of a new object in the ground plane");
        v.parameter("birth_vertical_velocity_sd_mps", birth_vertical_velocity_sd_mps, Range{0.01, 10.0}, "m/s",
                    "likewise, upwards");
        v.parameter("position_sd_m", position_sd_m, Range{0.005, 1.0}, "m",
                    "noise of a fully visible box centre; higher smooths more");
        v.parameter("size_sd_m", size_sd_m, Range{0.005, 2.0}, "m", "noise of a fully visible side");
        v.parameter("min_size_m", min_size_m, Range{0.01, 1.0}, "m", "no side of a box is shorter");
        v.parameter("max_speed_mps", max_speed_mps, Range{1.0, 200.0}, "m/s", "speeds are capped here");
    }
};

struct AssociationConfig {
    double alpha = 0.8;
    double beta = 0.1;
    double evidence_weight = 0.6;
    double max_speed_mps = 25.0;
    double gate_sigma = 3.5;
    double unmatched_cost = 0.88;
    bool second_pass = true;

    template <class V>
    void visit(V& v) {
        v.parameter("alpha", alpha, Range{0.0, 1.0}, "1", "weight of 1 - IoU in the association cost (Eq. 5)");
        v.parameter("beta", beta, Range{0.0, 1.0}, "1", "weight of the relative difference of point counts (Eq. 5)");
        v.parameter("evidence_weight", evidence_weight, Range{0.0, 1.0}, "1",
                    "added cost of matching a moving track with a detection that was there before, and the reverse; 0 "
                    "is the paper's cost");
        v.parameter("max_speed_mps", max_speed_mps, Range{0.1, 100.0}, "m/s",
                    "gate of tracks whose velocity is not known yet; higher lets faster objects be picked up");
        v.parameter("gate_sigma", gate_sigma, Range{0.5, 20.0}, "1",
                    "gate of tracks whose velocity is known, in standard deviations of the predicted position");
        v.parameter("unmatched_cost", unmatched_cost, Range{0.01, 10.0}, "1",
                    "a pair that costs more is left unmatched");
        v.flag("second_pass", second_pass, "match what is left by distance to the predicted box");
    }
};

struct DynamicStateConfig {
    bool use_residual = true;
    bool use_free_space = true;
    bool use_displacement = true;
    int n_min = 5;
    int n_max = 10;
    double theta_res = 0.3;
    double theta_disp_m = 0.75;
    int min_hits = 2;
    double dynamic_log_odds = 2.6;
    double static_log_odds = -3.0;
    double free_weight = 1.4;
    double free_fraction = 0.35;
    double residual_weight = 0.3;
    double displacement_weight = 1.0;
    double rest_time_s = 3.0;
    double rest_radius_m = 0.3;

    template <class V>
    void visit(V& v) {
        v.flag("use_residual", use_residual,
               "cue: average registration residual (Eq. 6); alone, it gives the paper's rule");
        v.flag("use_free_space", use_free_space, "cue: share of the points that lie where free space was seen");
        v.flag("use_displacement", use_displacement, "cue: registered displacement of the track's own points");
        v.parameter("n_min", n_min, Range{1, 100}, "frames",
                    "detections before a low residual speaks against motion; the paper's rule: before an object may be "
                    "dynamic");
        v.parameter("n_max", n_max, Range{1, 1000}, "frames",
                    "detections after which an object that is not dynamic is static");
        v.parameter("theta_res", theta_res, Range{0.0, 10.0}, "1",
                    "average residual over height that speaks for motion (Eq. 6)");
        v.parameter("theta_disp_m", theta_disp_m, Range{0.0, 10.0}, "m",
                    "the paper's rule: shift of both ends from the first position before an object may be dynamic");
        v.parameter("min_hits", min_hits, Range{1, 100}, "frames",
                    "detections before an object may be dynamic when cues are fused");
        v.parameter("dynamic_log_odds", dynamic_log_odds, Range{0.1, 8.0}, "1",
                    "log-odds of motion at which a track becomes dynamic; higher is later and surer");
        v.parameter("static_log_odds", static_log_odds, Range{-50.0, -0.1}, "1",
                    "log-odds of motion at which an undecided track becomes static");
        v.parameter("free_weight", free_weight, Range{0.0, 50.0}, "1",
                    "log-odds of a frame whose free share is twice the neutral one; higher decides earlier");
        v.parameter(
            "free_fraction", free_fraction, Range{0.01, 1.0}, "1",
            "share of the tested points in once free space that speaks neither for nor against motion, for up to "
            "40 points; less for more; higher is later and surer");
        v.parameter("residual_weight", residual_weight, Range{0.0, 50.0}, "1",
                    "log-odds a frame for each unit of residual over its threshold");
        v.parameter("displacement_weight", displacement_weight, Range{0.0, 50.0}, "1",
                    "scale of the log-odds of the registered displacement");
        v.parameter("rest_time_s", rest_time_s, Range{0.1, 600.0}, "s",
                    "a dynamic track that has rested this long is static again");
        v.parameter("rest_radius_m", rest_radius_m, Range{0.01, 5.0}, "m",
                    "what stays within this distance is at rest; higher calls slow motion rest");
    }
};

struct TrackingConfig {
    int max_misses = 10;
    int max_misses_undecided = 3;
    int max_misses_occluded = 40;
    int max_tracks = 512;
    KalmanConfig filter;
    AssociationConfig association;
    DynamicStateConfig state;

    template <class V>
    void visit(V& v) {
        v.parameter("max_misses", max_misses, Range{1, 1000}, "frames",
                    "a track that is not seen for so long dies (the paper's n)");
        v.parameter("max_misses_undecided", max_misses_undecided, Range{1, 1000}, "frames",
                    "likewise, for tracks that were never dynamic");
        v.parameter("max_misses_occluded", max_misses_occluded, Range{1, 10000}, "frames",
                    "likewise, where something nearer hides the track");
        v.parameter("max_tracks", max_tracks, Range{1, 4096}, "tracks",
                    "bound of the number of tracks; new objects wait");
        v.group("filter", filter, "Kalman filter of each track");
        v.group("association", association, "which detection belongs to which track");
        v.group("state", state, "undefined, static or dynamic");
    }
};

}  // namespace dlod
