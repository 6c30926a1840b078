// How long a loaded machine keeps this program from running: what a test of times has to allow for, and no more.
#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>

namespace dlod::test {

/// Nanoseconds that all threads of this program together have been ready to run and were not let, so far; next to
/// nothing on a machine that is free.
inline std::int64_t cpu_wait_ns() {
    std::int64_t total_ns = 0;
    for (const auto& thread : std::filesystem::directory_iterator("/proc/self/task")) {
        std::ifstream file(thread.path() / "schedstat");
        std::int64_t ran_ns = 0;
        std::int64_t waited_ns = 0;
        if (file >> ran_ns >> waited_ns) total_ns += waited_ns;
    }
    return total_ns;
}

}  // namespace dlod::test
