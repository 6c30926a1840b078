// Preloaded into a program, counts its allocations and appends "allocations bytes peak_kB" to the file that
// DLOD_ALLOCATION_REPORT names when the program ends.
#include <malloc.h>
#include <sys/resource.h>

#include <atomic>
#include <cerrno>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

extern "C" {
// glibc's own names: unlike dlsym(), they can be called before anything is set up.
void* __libc_malloc(std::size_t size);
void* __libc_calloc(std::size_t count, std::size_t size);
void* __libc_realloc(void* p, std::size_t size);
void* __libc_memalign(std::size_t alignment, std::size_t size);
}

namespace {

std::atomic<unsigned long> allocations{0};
std::atomic<unsigned long> bytes{0};

void count(std::size_t size) {
    allocations.fetch_add(1, std::memory_order_relaxed);
    bytes.fetch_add(size, std::memory_order_relaxed);
}

__attribute__((destructor)) void report() {
    const char* path = std::getenv("DLOD_ALLOCATION_REPORT");
    if (path == nullptr) return;
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const unsigned long counted = allocations.load();
    const unsigned long size = bytes.load();
    if (FILE* out = std::fopen(path, "a")) {
        std::fprintf(out, "%lu %lu %ld\n", counted, size, usage.ru_maxrss);
        std::fclose(out);
    }
}

}  // namespace

extern "C" {

void* malloc(std::size_t size) {
    count(size);
    return __libc_malloc(size);
}
void* calloc(std::size_t number, std::size_t size) {
    count(number * size);
    return __libc_calloc(number, size);
}
void* realloc(void* p, std::size_t size) {
    count(size);
    return __libc_realloc(p, size);
}
void* memalign(std::size_t alignment, std::size_t size) {
    count(size);
    return __libc_memalign(alignment, size);
}
void* aligned_alloc(std::size_t alignment, std::size_t size) {
    count(size);
    return __libc_memalign(alignment, size);
}
int posix_memalign(void** p, std::size_t alignment, std::size_t size) {
    count(size);
    *p = __libc_memalign(alignment, size);
    return *p != nullptr ? 0 : ENOMEM;
}
}
