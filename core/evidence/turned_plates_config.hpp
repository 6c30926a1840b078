// Tunables of the search for plates that turn.
#pragma once

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

}  // namespace dlod
