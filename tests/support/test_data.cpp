#include "tests/support/test_data.hpp"

#include <cstdlib>

namespace dlod::test {

std::optional<std::filesystem::path> data_path(const std::string& relative) {
    const char* configured = std::getenv("DLOD_TEST_DATA");
    const std::filesystem::path root = configured != nullptr ? configured : "../shared/data";
    std::error_code error;
    auto path = root / relative;
    if (!std::filesystem::exists(path, error)) return std::nullopt;
    return path;
}

}  // namespace dlod::test
