#include "daemon/pipeline/huge_pages.hpp"

#include <malloc.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>

namespace dlod::daemon {

void prefer_huge_pages() {
#ifdef __GLIBC__
    constexpr int kLargestThreshold_bytes = 32 << 20;  // glibc takes no larger one
    constexpr int kReserved_bytes = 256 << 20;         // of addresses; memory is taken when it is used
    constexpr std::uintptr_t kHugePage_bytes = 2 << 20;
    // One heap for all threads: those of their own would lie elsewhere.
    ::mallopt(M_ARENA_MAX, 1);
    ::mallopt(M_MMAP_THRESHOLD, kLargestThreshold_bytes);
    ::mallopt(M_TRIM_THRESHOLD, 2 * kReserved_bytes);
    ::mallopt(M_TOP_PAD, kReserved_bytes);
    void* const before = ::sbrk(0);
    void* volatile block = std::malloc(kLargestThreshold_bytes - 4096);  // makes the heap grow
    std::free(block);
    ::mallopt(M_TOP_PAD, kLargestThreshold_bytes);
    const auto first = (reinterpret_cast<std::uintptr_t>(before) + kHugePage_bytes - 1) / kHugePage_bytes;
    const auto last = reinterpret_cast<std::uintptr_t>(::sbrk(0)) / kHugePage_bytes;
    if (last > first) {
        ::madvise(reinterpret_cast<void*>(first * kHugePage_bytes), (last - first) * kHugePage_bytes, MADV_HUGEPAGE);
    }
#endif
}

}  // namespace dlod::daemon
