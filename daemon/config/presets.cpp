#include "daemon/config/presets.hpp"

#include <algorithm>
#include <cctype>

#include "driver/metadata.hpp"

namespace dlod::daemon {

const std::vector<Preset>& presets() {
    // The defaults are those of 128 rows, of which 43 are candidates; with 32 rows as many candidates need more
    // columns.
    static const std::vector<Preset> table = {
        {"OS0", 32, {"subsampling.column_step=3"}},
        {"OS1", 32, {"subsampling.column_step=3"}},
        {"OS2", 32, {"subsampling.column_step=3"}},
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
