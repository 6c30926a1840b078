// Where tests find recorded data, which is not part of the product.
#pragma once

#include <filesystem>
#include <optional>
#include <string>

namespace dlod::test {

/// Path of `relative` inside the data folder (DLOD_TEST_DATA, else ../shared/data beside the checkout), or nothing when
/// it is not there. Tests then call GTEST_SKIP() and name what they miss.
std::optional<std::filesystem::path> data_path(const std::string& relative);

}  // namespace dlod::test
