// Any bytes as the sensor's metadata: a usable sensor or an error, and what is called usable has sizes that agree.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "driver/metadata.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace dlod::driver;
    try {
        const SensorInfo info = parse_metadata({reinterpret_cast<const char*>(data), size}, "fuzzed");
        const auto rows = static_cast<std::size_t>(info.model.height);
        if (info.format == nullptr || info.model.height <= 0 || info.model.width <= 0 ||
            info.model.altitude_rad.size() != rows || info.model.azimuth_offset_rad.size() != rows ||
            info.model.pixel_shift.size() != rows || info.columns_per_packet <= 0) {
            std::abort();
        }
    } catch (const MetadataError&) {
        return 0;
    }
    return 0;
}
