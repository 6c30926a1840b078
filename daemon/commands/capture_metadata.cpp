#include "daemon/commands/capture_metadata.hpp"

#include "driver/pcap_source.hpp"

namespace dlod::daemon {

driver::SensorInfo load_capture_metadata(const std::filesystem::path& capture,
                                         const std::optional<std::filesystem::path>& metadata) {
    const driver::PcapSource opened(capture);
    if (metadata) return driver::load_metadata(*metadata);
    auto beside = capture;
    beside.replace_extension(".json");
    if (!std::filesystem::exists(beside)) {
        throw driver::MetadataError(beside.string() + ": not there; give the sensor's metadata with --metadata");
    }
    return driver::load_metadata(beside);
}

}  // namespace dlod::daemon
