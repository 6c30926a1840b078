// A program under test.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace dlod::test {

/// Runs a program; stdout and stderr go to a file. Killed by the destructor where it still runs.
class ChildProcess {
  public:
    struct Options {
        std::vector<std::string> environment;       ///< "NAME=value", added to this process's
        std::optional<unsigned long> largest_file;  ///< bytes; a longer write fails, as on a full disk
    };

    explicit ChildProcess(std::vector<std::string> command);
    ChildProcess(std::vector<std::string> command, const Options& options);
    ~ChildProcess();
    ChildProcess(const ChildProcess&) = delete;
    ChildProcess& operator=(const ChildProcess&) = delete;

    pid_t pid() const { return pid_; }
    void signal(int number) const;
    /// Exit code, 128 + the number of the signal that ended it, or nothing where it still runs after the timeout.
    std::optional<int> wait(std::chrono::milliseconds timeout);
    /// What it has printed so far.
    std::string output() const;

  private:
    std::filesystem::path output_file_;
    pid_t pid_ = -1;
    std::optional<int> exit_code_;
};

/// Puts this process into a network namespace of its own, with loopback and a multicast route over it.
/// @return false where the system does not allow it; nothing has changed then
bool enter_network_namespace();

}  // namespace dlod::test
