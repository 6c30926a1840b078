// The checks of `dlod doctor`: what the machine must offer, each with the command that mends it.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>

#include "daemon/doctor/installed_service.hpp"

namespace dlod::daemon {

/// One finding.
struct Check {
    enum class Verdict : std::uint8_t {
        kGood,
        kWarning,  ///< dlod runs, but worse than it could
        kFailure   ///< dlod cannot do its job
    };
    std::string name;
    Verdict verdict = Verdict::kGood;
    std::string finding;  ///< what was found, one line
    std::string remedy;   ///< the command or the setting that mends it, empty when good
};

/// Can a UDP socket get a receive buffer of `wanted_bytes`?
Check check_receive_buffer(int wanted_bytes);

/// Does a multicast datagram to the group of the LCM URL ("udpm://239.255.76.67:7667?ttl=1") find a way out? Nothing is
/// sent. A ttl of 0 keeps messages on this host, which is worth a word.
Check check_multicast(const std::string& lcm_url);

/// May this process ask for SCHED_FIFO at `priority` (0: not configured)?
Check check_realtime_priority(int priority);

/// May this process lock its memory?
Check check_locked_memory(bool configured);

/// Is the host's clock disciplined by NTP or PTP?
Check check_clock_synchronised();

/// Are at least `wanted_bytes` free in `directory`, what its files take included, and may files be made there? Where it
/// is not there yet, dlod makes it: then the folder that it will be in is looked at. In a service's own directory,
/// which systemd makes for it, only room is looked for; elsewhere its unit must let it in.
Check check_disk(const std::filesystem::path& directory, std::uint64_t wanted_bytes,
                 const std::optional<InstalledService>& service = std::nullopt);

/// Does the sensor answer over HTTP? An empty host is good: metadata come from a file then, which the service, if any,
/// must be able to see.
Check check_sensor(const std::string& host, const std::string& metadata,
                   const std::optional<InstalledService>& service = std::nullopt);

}  // namespace dlod::daemon
