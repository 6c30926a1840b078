// What the range of no single key can tell.
#pragma once

#include "daemon/config/config.hpp"

namespace dlod::daemon {

/// Keys that contradict each other, or texts that are no addresses or channels: found before anything is begun.
/// @throws ConfigError that names the key
void check_consistency(const Config& config);

}  // namespace dlod::daemon
