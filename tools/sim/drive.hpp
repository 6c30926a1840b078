// A drive from its first turn to its last.
#pragma once

#include <functional>

#include "tools/sim/lidar.hpp"
#include "tools/sim/packet_stream.hpp"

namespace dlod::tools::sim {

/// Takes a turn when it is done: the scan with what was lost cleared, its packets, the datagrams that are due.
using TurnSink = std::function<void(const Scan&, const std::vector<PacketRecord>&, const std::vector<Datagram>&)>;

/// Scans `turns` turns on `threads` threads and hands them over in order; the outcome does not depend on the threads.
void run_drive(const World& world, const Lidar& lidar, PacketStream& stream, int turns, int threads,
               const TurnSink& sink);

}  // namespace dlod::tools::sim
