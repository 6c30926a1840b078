#include "daemon/pipeline/huge_pages.hpp"

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <sstream>
#include <string>

namespace dlod::daemon {
namespace {

/// True where the kernel was asked for huge pages for the mapping that holds the address.
bool huge_pages_wanted(const void* address) {
    const auto wanted = reinterpret_cast<std::uintptr_t>(address);
    std::ifstream maps("/proc/self/smaps");
    bool inside = false;
    for (std::string line; std::getline(maps, line);) {
        std::uintptr_t first = 0, last = 0;
        char dash = 0;
        if (std::istringstream range(line); range >> std::hex >> first >> dash >> last && dash == '-') {
            inside = first <= wanted && wanted < last;
        }
        if (inside && line.starts_with("VmFlags:")) return line.find(" hg") != std::string::npos;
    }
    return false;
}

#ifdef DLOD_SANITIZED
constexpr bool kOwnAllocator = true;
#else
constexpr bool kOwnAllocator = false;
#endif

TEST(HugePages, LargeBlocksLieInThem) {
    if (kOwnAllocator) GTEST_SKIP() << "sanitizers have an allocator of their own";
    if (!std::filesystem::exists("/sys/kernel/mm/transparent_hugepage")) GTEST_SKIP() << "no huge pages here";
    prefer_huge_pages();
    constexpr std::size_t kImage_bytes = 512 << 10;
    int wanted = 0;
    std::unique_ptr<std::byte[]> images[40];
    for (auto& image : images) {
        image = std::make_unique<std::byte[]>(kImage_bytes);
        wanted += huge_pages_wanted(image.get()) ? 1 : 0;
    }
    EXPECT_GE(wanted, 35);  // some may fit into gaps of the heap as it was
}

}  // namespace
}  // namespace dlod::daemon
