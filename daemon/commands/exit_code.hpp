#pragma once

namespace dlod::daemon {

/// What the program's exit code tells; documented in the README and in `dlod --help`.
enum class ExitCode : int {
    kSuccess = 0,        ///< replay: the capture's end was reached, whatever its packets were like
    kFailure = 1,        ///< anything not named below
    kUsage = 2,          ///< wrong command line
    kConfiguration = 3,  ///< configuration file, setting or sensor metadata
    kInput = 4,          ///< capture or socket cannot be opened
    kOutput = 5,         ///< results cannot be written
    kMessages = 6,       ///< LCM cannot be reached
    kInterrupted = 7,    ///< replay was ended by a signal before the capture's end; the results so far are complete
};

}  // namespace dlod::daemon
