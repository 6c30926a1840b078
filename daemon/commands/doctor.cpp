#include <chrono>
#include <cstdio>
#include <optional>
#include <string>

#include "daemon/commands/commands.hpp"
#include "daemon/commands/load_config.hpp"
#include "daemon/doctor/checks.hpp"
#include "daemon/doctor/installed_service.hpp"
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

/// Prints findings as they come: some of the checks take seconds.
class Report {
  public:
    void add(const Check& check) {
        failed_ = failed_ || check.verdict == Check::Verdict::kFailure;
        std::printf("%-8s %s: %s\n", word_for(check.verdict), check.name.c_str(), check.finding.c_str());
        if (!check.remedy.empty()) std::printf("         -> %s\n", check.remedy.c_str());
        std::fflush(stdout);
    }
    bool failed() const { return failed_; }

  private:
    bool failed_ = false;
};

/// What the configuration's paths mean to its service, whoever calls the doctor from wherever.
void resolve_paths(const InstalledService& service, Config& config) {
    if (config.saved_maps.folder.empty()) config.saved_maps.folder = "maps";
    for (std::string* path :
         {&config.sensor.metadata, &config.output.folder, &config.recording.folder, &config.saved_maps.folder}) {
        if (!path->empty()) *path = service.resolve(*path).string();
    }
}

void check_folders(const Config& config, const std::optional<InstalledService>& service, Report& report) {
    const auto check = [&](const char* what, const std::string& folder, std::uint64_t wanted_bytes) {
        if (folder.empty()) return;
        Check disk = check_disk(folder, wanted_bytes, service);
        disk.name = what;
        report.add(disk);
    };
    // Room for an hour of results at 128 x 1024 and 10 Hz.
    check("output.folder", config.output.folder, 25'000'000'000);
    check("recording.folder", config.recording.folder,
          std::uint64_t{1'000'000} * static_cast<std::uint64_t>(config.recording.files) *
              static_cast<std::uint64_t>(config.recording.file_megabytes));
    // One map, as PCD and PLY.
    check("saved_maps.folder", config.saved_maps.folder,
          2 * sizeof(MapPoint) * static_cast<std::uint64_t>(config.method.map.max_points));
}

}  // namespace

ExitCode doctor(const ConfigSources& sources) {
    Config config = load_config(sources, nullptr);
    Report report;
    const auto service = sources.file ? service_of(*sources.file) : std::nullopt;
    if (service) {
        resolve_paths(*service, config);
        report.add({"service", Check::Verdict::kGood,
                    service->unit + ", whose relative paths are in " + service->state_directory.string(), ""});
    }
    report.add(check_receive_buffer(config.sensor.receive_buffer_bytes));
    report.add(check_realtime_priority(config.pipeline.realtime_priority));
    report.add(check_locked_memory(config.pipeline.lock_memory));
    report.add(check_clock_synchronised());
    if (config.lcm.url != "none") report.add(check_multicast(url_or_default(config.lcm.url)));
    check_folders(config, service, report);
    report.add(check_sensor(config.sensor.host, config.sensor.metadata, service));
    report.add(check_packets(config.sensor, kPacketTime));
    return report.failed() ? ExitCode::kFailure : ExitCode::kSuccess;
}

}  // namespace dlod::daemon
