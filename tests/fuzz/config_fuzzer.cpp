// Any bytes as a configuration file: an error or a configuration, and one that is taken is written out and read back as
// the same.
#include <cstdint>
#include <cstdlib>
#include <string>

#include "daemon/config/config.hpp"
#include "daemon/config/config_file.hpp"
#include "daemon/config/consistency.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace dlod::daemon;
    Config config;
    try {
        apply_yaml(config, {reinterpret_cast<const char*>(data), size}, "fuzzed");
        check_consistency(config);
    } catch (const ConfigError&) {
        return 0;
    }
    const std::string written = to_yaml(config);
    Config again;
    apply_yaml(again, written, "written");
    if (to_yaml(again) != written) std::abort();
    return 0;
}
