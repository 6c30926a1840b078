#pragma once

#include "daemon/config/config.hpp"

namespace dlod::daemon {

/// Names the calling thread and gives it the CPUs and the priority of the configuration; what the system refuses is
/// logged with the remedy and does not stop the program.
void set_up_thread(const char* name, const PipelineConfig& config);

/// Keeps the process's memory resident where the configuration asks for it; a refusal is logged.
void lock_memory(const PipelineConfig& config);

}  // namespace dlod::daemon
