// Faults that a drive has on demand.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/sim/datagram.hpp"
#include "tools/sim/random.hpp"

namespace dlod::tools::sim {

enum class ImuFault { kNone, kOff, kSilent, kStuck, kSpikes, kAxes, kScale };

struct FaultOptions {
    double loss = 0.0;         ///< share of the lidar packets that never arrive
    double duplication = 0.0;  ///< share that arrives twice
    double reordering = 0.0;   ///< share that arrives one to three packets late
    double corruption = 0.0;   ///< share that is cut short, overwritten, of a stranger, or marked invalid
    std::vector<std::pair<double, double>> gaps_s;       ///< nothing arrives: from, length
    std::vector<double> restarts_s;                      ///< the sensor restarts and is away for kRestart_s
    std::vector<std::pair<double, double>> sectors_deg;  ///< columns that are marked invalid: from, to, by encoder
    ImuFault imu = ImuFault::kNone;
    std::optional<std::pair<double, double>> imu_fault_s;   ///< when the IMU has it: from, length; else by kind
    std::optional<std::pair<double, double>> clock_step_s;  ///< from a time on, all stamps are off by so much

    static constexpr double kRestart_s = 0.55;
};

enum class PacketFault { kNone, kLost, kDuplicated, kReordered, kCorrupted };

/// As in packets.csv.
std::string_view name_of(PacketFault fault);

/// True where nothing is sent at a time: a gap, or a sensor that restarts.
bool is_silent(const FaultOptions& faults, double t);

/// True where the IMU has its fault at a time of a drive of this length.
bool imu_is_faulty(const FaultOptions& faults, double t, double duration_s);

/// What the sensor's clock shows more than the time.
double clock_offset_s(const FaultOptions& faults, double t);

/// Number of restarts that a sensor has behind it at a time.
int restarts_before(const FaultOptions& faults, double t);

/// True where the columns of a direction are marked invalid.
bool in_missing_sector(const FaultOptions& faults, double encoder_deg);

/// What happens to a packet; drawn from its own stream.
PacketFault draw_fault(const FaultOptions& faults, Random& random);

}  // namespace dlod::tools::sim
