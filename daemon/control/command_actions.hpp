// What commands do: to a running pipeline, and while there is none.
#pragma once

#include "daemon/control/command_handler.hpp"
#include "daemon/output/map_store.hpp"
#include "daemon/pipeline/pipeline.hpp"

namespace dlod::daemon {

/// Saving a map takes none of the pipeline's time but a copy. Both must outlive the actions.
CommandActions pipeline_actions(const MapStore& maps, Pipeline& pipeline);

/// Of a service that still waits for its sensor: there is no map, and the odometry begins anew anyway.
CommandActions waiting_actions();

}  // namespace dlod::daemon
