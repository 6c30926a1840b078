// How long a loaded machine keeps this program from running: what a test of times has to allow for, and no more.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <map>

namespace dlod::test {

/// For one thread at a time.
class CpuWait {
  public:
    /// Nanoseconds that all threads of this program together have been ready to run and were not let, so far; next to
    /// nothing on a machine that is free. What a thread that has ended waited for after the last call is not in it.
    std::int64_t total_ns() {
        for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
            std::ifstream file(thread.path() / "schedstat");
            std::int64_t ran_ns = 0;
            std::int64_t waited_ns = 0;
            if (!(file >> ran_ns >> waited_ns)) continue;
            std::int64_t& known_ns = waited_ns_[thread.path()];
            total_ns_ += waited_ns - known_ns;
            known_ns = waited_ns;
        }
        return total_ns_;
    }

  private:
    std::map<std::filesystem::path, std::int64_t> waited_ns_;
    std::int64_t total_ns_ = 0;
};

}  // namespace dlod::test
