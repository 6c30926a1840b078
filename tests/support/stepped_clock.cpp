// To be preloaded into a program: its host's clock can be set while it runs, the kernel's receive stamps with it. The
// file in DLOD_TEST_CLOCK holds by how much it is off, int64 nanoseconds in the machine's byte order.
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/mman.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <ctime>

namespace {

using Offset = std::atomic<std::int64_t>;

const Offset* open_offset() {
    const char* const file = std::getenv("DLOD_TEST_CLOCK");
    const int descriptor = file == nullptr ? -1 : ::open(file, O_RDONLY | O_CLOEXEC);
    if (descriptor < 0) return nullptr;
    void* const mapped = ::mmap(nullptr, sizeof(Offset), PROT_READ, MAP_SHARED, descriptor, 0);
    ::close(descriptor);
    return mapped == MAP_FAILED ? nullptr : static_cast<const Offset*>(mapped);
}

void shift(timespec& time) {
    static const Offset* const offset = open_offset();
    if (offset == nullptr) return;
    constexpr std::int64_t kSecond = 1'000'000'000;
    const std::int64_t ns = time.tv_nsec + offset->load() % kSecond + kSecond;
    time.tv_sec += offset->load() / kSecond + ns / kSecond - 1;
    time.tv_nsec = ns % kSecond;
}

template <class F>
F next(const char* name) {
    return reinterpret_cast<F>(::dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
    static const auto original = next<int (*)(clockid_t, timespec*)>("clock_gettime");
    const int result = original(clock, time);
    if (result == 0 && clock == CLOCK_REALTIME) shift(*time);
    return result;
}

extern "C" int recvmmsg(int socket, mmsghdr* messages, unsigned count, int flags, timespec* timeout) {
    static const auto original = next<int (*)(int, mmsghdr*, unsigned, int, timespec*)>("recvmmsg");
    const int received = original(socket, messages, count, flags, timeout);
    for (int i = 0; i < received; ++i) {
        msghdr& header = messages[i].msg_hdr;
        for (cmsghdr* c = CMSG_FIRSTHDR(&header); c != nullptr; c = CMSG_NXTHDR(&header, c)) {
            if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_TIMESTAMPNS) continue;
            timespec stamp{};
            std::memcpy(&stamp, CMSG_DATA(c), sizeof stamp);
            shift(stamp);
            std::memcpy(CMSG_DATA(c), &stamp, sizeof stamp);
        }
    }
    return received;
}
