#include "tests/driver/clean_frames.hpp"

#include <gtest/gtest.h>

namespace dlod::driver::test {

void expect_clean_frames(BuilderBench& bench, std::uint32_t first_id) {
    const std::size_t before = bench.emitted.size();
    for (std::uint32_t k = 0; k < 3; ++k) bench.push_frame(first_id + k);
    ASSERT_EQ(bench.emitted.size(), before + 3);
    for (std::size_t k = 0; k < 3; ++k) {
        EXPECT_EQ(bench.wrong_pixels(bench.emitted[before + k]), 0);
        EXPECT_TRUE(bench.emitted[before + k].header.usable);
    }
}

}  // namespace dlod::driver::test
