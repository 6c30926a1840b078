#include "daemon/config/presets.hpp"

#include <algorithm>
#include <cctype>

#include "driver/metadata.hpp"

namespace dlod::daemon {

const std::vector<Preset>& presets() {
    // The defaults are those of an OS0 with 128 rows. Sensors that see less around them, or less densely, need more of
    // their pixels as candidates: else too little holds the directions in which a corridor or a street is uniform.
    static const std::vector<Preset> table = {
        {"OS0", 64, {"subsampling.rows=64", "subsampling.column_step=2"}},
        {"OS0", 32, {"subsampling.column_step=1"}},
        {"OS1", 128, {"subsampling.column_step=2"}},
        {"OS1", 64, {"subsampling.rows=64", "subsampling.column_step=2"}},
        {"OS1", 32, {"subsampling.column_step=1"}},
        {"OS2", 128, {"subsampling.column_step=2"}},
        {"OS2", 64, {"subsampling.rows=64", "subsampling.column_step=2"}},
        {"OS2", 32, {"subsampling.column_step=1"}},
    };
    return table;
}

const Preset* find_preset(const driver::SensorInfo& sensor) {
    // "OS-0-128-U1" and "OS0-128" are the same product.
    std::string product = sensor.product_line;
    std::erase(product, '-');
    const auto& table = presets();
    const auto found = std::find_if(table.begin(), table.end(), [&](const Preset& preset) {
        return product.starts_with(preset.product) && preset.rows == sensor.model.height;
    });
    return found == table.end() ? nullptr : &*found;
}

}  // namespace dlod::daemon
