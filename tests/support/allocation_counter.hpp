// Counts every allocation of a test program that calls it.
#pragma once

#include <cstddef>

namespace dlod::test {

/// Calls of operator new of all threads since the program's start.
std::size_t allocation_count();

}  // namespace dlod::test
