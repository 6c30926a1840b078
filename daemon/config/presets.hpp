// Settings that suit a sensor better than the general defaults.
#pragma once

#include <string>
#include <vector>

namespace dlod::driver {
struct SensorInfo;
}

namespace dlod::daemon {

struct Preset {
    std::string product;  ///< "OS0", "OS1", "OS2"
    int rows;
    std::vector<std::string> settings;  ///< "key=value"
};

/// All presets; every key in them is known and every value valid (a test sees to it).
const std::vector<Preset>& presets();

/// The preset of a sensor, by product line and rows; nullptr where the defaults serve.
const Preset* find_preset(const driver::SensorInfo& sensor);

}  // namespace dlod::daemon
