#include "daemon/commands/commands.hpp"
#include "daemon/commands/live_service.hpp"

namespace dlod::daemon {

ExitCode run(const RunArguments& arguments) {
    LiveService(arguments.config).run();
    return ExitCode::kSuccess;
}

}  // namespace dlod::daemon
