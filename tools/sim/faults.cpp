#include "tools/sim/faults.hpp"

#include <algorithm>

namespace dlod::tools::sim {

std::string_view name_of(PacketFault fault) {
    switch (fault) {
        case PacketFault::kLost:
            return "lost";
        case PacketFault::kDuplicated:
            return "duplicated";
        case PacketFault::kReordered:
            return "reordered";
        case PacketFault::kCorrupted:
            return "corrupted";
        case PacketFault::kNone:
            break;
    }
    return "ok";
}

bool is_silent(const FaultOptions& faults, double t) {
    const auto within = [t](double from, double length) { return t >= from && t < from + length; };
    return std::any_of(faults.gaps_s.begin(), faults.gaps_s.end(),
                       [&](const auto& gap) { return within(gap.first, gap.second); }) ||
           std::any_of(faults.restarts_s.begin(), faults.restarts_s.end(),
                       [&](double at) { return within(at, FaultOptions::kRestart_s); });
}

bool imu_is_faulty(const FaultOptions& faults, double t, double duration_s) {
    if (faults.imu_fault_s) {
        const auto [from, length] = *faults.imu_fault_s;
        return t >= from && t < from + length;
    }
    if (faults.imu == ImuFault::kSilent) return t > 0.4 * duration_s;
    if (faults.imu == ImuFault::kStuck) return t > 0.3 * duration_s;
    return faults.imu != ImuFault::kNone;
}

double clock_offset_s(const FaultOptions& faults, double t) {
    return faults.clock_step_s && t >= faults.clock_step_s->first ? faults.clock_step_s->second : 0.0;
}

int restarts_before(const FaultOptions& faults, double t) {
    return static_cast<int>(std::count_if(faults.restarts_s.begin(), faults.restarts_s.end(),
                                          [t](double at) { return t >= at + FaultOptions::kRestart_s; }));
}

bool in_missing_sector(const FaultOptions& faults, double encoder_deg) {
    return std::any_of(faults.sectors_deg.begin(), faults.sectors_deg.end(), [&](const auto& sector) {
        const auto [from, to] = sector;
        return from <= to ? encoder_deg >= from && encoder_deg < to : encoder_deg >= from || encoder_deg < to;
    });
}

PacketFault draw_fault(const FaultOptions& faults, Random& random) {
    double u = random.uniform();
    for (const auto& [share, fault] :
         {std::pair{faults.loss, PacketFault::kLost}, std::pair{faults.corruption, PacketFault::kCorrupted},
          std::pair{faults.duplication, PacketFault::kDuplicated},
          std::pair{faults.reordering, PacketFault::kReordered}}) {
        if (u < share) return fault;
        u -= share;
    }
    return PacketFault::kNone;
}

}  // namespace dlod::tools::sim
