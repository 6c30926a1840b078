#include "daemon/config/presets.hpp"

#include <algorithm>
#include <cctype>

#include "driver/metadata.hpp"

namespace dlod::daemon {

const std::vector<Preset>& presets() {
    // The defaults are those of an OS0-128. With fewer rows every row counts for the registration.
    static const std::vector<Preset> table = {
        {"OS0", 64, {"subsampling.row_step=1"}}, {"OS0", 32, {"subsampling.row_step=1", "subsampling.column_step=3"}},
        {"OS1", 64, {"subsampling.row_step=1"}}, {"OS1", 32, {"subsampling.row_step=1", "subsampling.column_step=3"}},
        {"OS2", 64, {"subsampling.row_step=1"}}, {"OS2", 32, {"subsampling.row_step=1", "subsampling.column_step=3"}},
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
