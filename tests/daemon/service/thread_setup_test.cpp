#include "daemon/service/thread_setup.hpp"

#include <gtest/gtest.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>
#include <vector>

namespace dlod::daemon {
namespace {

std::size_t locked_kilobytes() {
    std::ifstream status("/proc/self/status");
    for (std::string word; status >> word;) {
        std::size_t kilobytes = 0;
        if (word == "VmLck:" && status >> kilobytes) return kilobytes;
    }
    return 0;
}

TEST(LockMemory, KeepsWhatIsUsedAndTakesNoneForWhatIsNot) {
    constexpr std::size_t kBytes = 16 << 20;
    const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    void* const reserve = ::mmap(nullptr, kBytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    ASSERT_NE(reserve, MAP_FAILED);
    ::madvise(reserve, kBytes, MADV_NOHUGEPAGE);
    const auto resident_pages = [&] {
        std::vector<unsigned char> resident(kBytes / page);
        EXPECT_EQ(::mincore(reserve, kBytes, resident.data()), 0);
        return std::count_if(resident.begin(), resident.end(), [](unsigned char r) { return (r & 1U) != 0; });
    };
    PipelineConfig config;
    lock_memory(config);
    EXPECT_EQ(locked_kilobytes(), 0U) << "only where it is asked for";
    config.lock_memory = true;
    lock_memory(config);
    const std::size_t locked = locked_kilobytes();
    const auto unused = resident_pages();
    static_cast<volatile char*>(reserve)[0] = 1;
    const auto used = resident_pages();
    ::munlockall();
    ::munmap(reserve, kBytes);
    if (locked == 0) GTEST_SKIP() << "memory cannot be locked here";
    EXPECT_GT(1024 * locked, kBytes);
    EXPECT_EQ(unused, 0);
    EXPECT_EQ(used, 1);
}

}  // namespace
}  // namespace dlod::daemon
