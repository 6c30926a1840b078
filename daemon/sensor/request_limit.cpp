#include "daemon/sensor/request_limit.hpp"

#include <linux/tcp.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>

#include <utility>

namespace dlod::daemon {
namespace {

constexpr int kLookEvery_ms = 20;

std::uint64_t received_bytes(int socket) {
    tcp_info info{};
    socklen_t length = sizeof info;
    return ::getsockopt(socket, IPPROTO_TCP, TCP_INFO, &info, &length) == 0 ? info.tcpi_bytes_received : 0;
}

}  // namespace

RequestLimit::RequestLimit(std::uint64_t most_bytes, std::chrono::milliseconds longest, std::function<void()> cut_off)
    : most_bytes_(most_bytes),
      deadline_(std::chrono::steady_clock::now() + longest),
      cut_off_(std::move(cut_off)),
      thread_([this] { watch(); }) {}

RequestLimit::~RequestLimit() {
    finished_.set();
    thread_.join();
}

void RequestLimit::watch() {
    pollfd finished{finished_.fd(), POLLIN, 0};
    while (::poll(&finished, 1, kLookEvery_ms) <= 0) {
        if (received_bytes(socket_) > most_bytes_) too_large_ = true;
        if (too_large_ || std::chrono::steady_clock::now() > deadline_) cut_off_();
    }
}

}  // namespace dlod::daemon
