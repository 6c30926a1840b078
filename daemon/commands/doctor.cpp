#include <algorithm>
#include <chrono>
#include <cstdio>
#include <vector>

#include "daemon/commands/commands.hpp"
#include "daemon/commands/load_config.hpp"
#include "daemon/doctor/checks.hpp"
#include "daemon/doctor/packet_check.hpp"
#include "daemon/publish/lcm_url.hpp"

namespace dlod::daemon {
namespace {

/// Long enough to see one lost packet in a thousand.
constexpr auto kPacketTime = std::chrono::seconds(4);

const char* word_for(Check::Verdict verdict) {
    switch (verdict) {
        case Check::Verdict::kGood:
            return "good";
        case Check::Verdict::kWarning:
            return "warning";
        case Check::Verdict::kFailure:
            break;
    }
    return "FAILURE";
}

}  // namespace

ExitCode doctor(const ConfigSources& sources) {
    const Config config = load_config(sources, nullptr);
    std::vector<Check> checks = {check_receive_buffer(config.sensor.receive_buffer_bytes),
                                 check_realtime_priority(config.pipeline.realtime_priority),
                                 check_locked_memory(config.pipeline.lock_memory),
                                 check_clock_synchronised(),
                                 check_sensor(config.sensor.host, config.sensor.metadata),
                                 check_packets(config.sensor, kPacketTime)};
    if (config.lcm.url != "none") checks.push_back(check_multicast(url_or_default(config.lcm.url)));
    // Room for an hour of results at 128 x 1024 and 10 Hz.
    constexpr std::uint64_t kResultBytes = 25'000'000'000;
    if (!config.output.folder.empty()) checks.push_back(check_disk(config.output.folder, kResultBytes));
    if (!config.recording.folder.empty()) {
        checks.push_back(check_disk(config.recording.folder,
                                    std::uint64_t{1'000'000} * static_cast<std::uint64_t>(config.recording.files) *
                                        static_cast<std::uint64_t>(config.recording.file_megabytes)));
    }
    if (!config.saved_maps.folder.empty()) {
        // One map, as PCD and PLY.
        checks.push_back(check_disk(config.saved_maps.folder,
                                    2 * sizeof(MapPoint) * static_cast<std::uint64_t>(config.method.map.max_points)));
    }
    for (const Check& check : checks) {
        std::printf("%-8s %s: %s\n", word_for(check.verdict), check.name.c_str(), check.finding.c_str());
        if (!check.remedy.empty()) std::printf("         -> %s\n", check.remedy.c_str());
    }
    const bool failed = std::any_of(checks.begin(), checks.end(),
                                    [](const Check& check) { return check.verdict == Check::Verdict::kFailure; });
    return failed ? ExitCode::kFailure : ExitCode::kSuccess;
}

}  // namespace dlod::daemon
