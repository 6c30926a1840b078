#pragma once

#include "daemon/config/config.hpp"
#include "driver/metadata.hpp"
#include "driver/udp_source.hpp"

namespace dlod::daemon {

/// How the packets of a sensor are received: as configured, ports that are not from the metadata.
driver::UdpOptions udp_options(const SensorConfig& config, const driver::SensorInfo& sensor);

}  // namespace dlod::daemon
