#pragma once

#include <cstdint>

#include "tests/driver/synthetic_sensor.hpp"

namespace dlod::driver::test {

/// Pushes three clean frames and expects them to come out unharmed, whatever came before.
void expect_clean_frames(BuilderBench& bench, std::uint32_t first_id);

}  // namespace dlod::driver::test
