// Stands in for systemd: collects what a service tells by sd_notify.
#pragma once

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>

namespace dlod::test {

/// Reads in a thread of its own, as systemd does: a service would wait for a reader that has fallen behind.
class NotifySocket {
  public:
    explicit NotifySocket(const std::filesystem::path& folder) : path_((folder / "notify").string()) {
        socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        path_.copy(address.sun_path, sizeof(address.sun_path) - 1);
        if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
            ADD_FAILURE() << "bind " << path_;
        thread_ = std::thread([this] { read(); });
    }
    ~NotifySocket() {
        stopping_ = true;
        thread_.join();
        ::close(socket_);
        std::error_code ignored;
        std::filesystem::remove(path_, ignored);
    }
    NotifySocket(const NotifySocket&) = delete;
    NotifySocket& operator=(const NotifySocket&) = delete;

    /// For the environment of the service.
    std::string variable() const { return "NOTIFY_SOCKET=" + path_; }
    /// All that was told so far, a message a line.
    std::string messages() const {
        const std::lock_guard lock(mutex_);
        return messages_;
    }
    bool wait_for(const std::string& text, std::chrono::milliseconds timeout) const {
        const auto deadline = std::chrono::steady_clock::now() + timeout;
        while (messages().find(text) == std::string::npos) {
            if (std::chrono::steady_clock::now() > deadline) return false;
            std::this_thread::sleep_for(std::chrono::milliseconds(10));
        }
        return true;
    }
    /// Forgets what was told so far.
    void clear() {
        const std::lock_guard lock(mutex_);
        messages_.clear();
    }

  private:
    void read() {
        char buffer[2048];
        while (!stopping_) {
            pollfd watched{socket_, POLLIN, 0};
            ::poll(&watched, 1, 20);
            const ssize_t n = ::recv(socket_, buffer, sizeof(buffer), MSG_DONTWAIT);
            if (n <= 0) continue;
            const std::lock_guard lock(mutex_);
            messages_.append(buffer, static_cast<std::size_t>(n)) += '\n';
        }
    }

    std::string path_;
    int socket_;
    mutable std::mutex mutex_;
    std::string messages_;
    std::atomic<bool> stopping_{false};
    std::thread thread_;
};

}  // namespace dlod::test
