// Stands in for systemd: collects what a service tells by sd_notify.
#pragma once

#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <string>

namespace dlod::test {

class NotifySocket {
  public:
    explicit NotifySocket(const std::filesystem::path& folder) : path_((folder / "notify").string()) {
        socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        sockaddr_un address{};
        address.sun_family = AF_UNIX;
        path_.copy(address.sun_path, sizeof(address.sun_path) - 1);
        if (::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
            ADD_FAILURE() << "bind " << path_;
    }
    ~NotifySocket() {
        ::close(socket_);
        std::error_code ignored;
        std::filesystem::remove(path_, ignored);
    }
    NotifySocket(const NotifySocket&) = delete;
    NotifySocket& operator=(const NotifySocket&) = delete;

    /// For the environment of the service.
    std::string variable() const { return "NOTIFY_SOCKET=" + path_; }
    /// All that was told so far, a message a line.
    const std::string& messages() {
        char buffer[2048];
        for (ssize_t n = 0; (n = ::recv(socket_, buffer, sizeof(buffer), MSG_DONTWAIT)) > 0;) {
            messages_.append(buffer, static_cast<std::size_t>(n)) += '\n';
        }
        return messages_;
    }
    bool wait_for(const std::string& text, std::chrono::milliseconds timeout) {
        const auto deadline = std::chrono::steady_clock::now() + timeout;
        while (messages().find(text) == std::string::npos) {
            if (std::chrono::steady_clock::now() > deadline) return false;
            pollfd watched{socket_, POLLIN, 0};
            ::poll(&watched, 1, 20);
        }
        return true;
    }
    /// Forgets what was told so far.
    void clear() {
        messages();
        messages_.clear();
    }

  private:
    std::string path_;
    int socket_;
    std::string messages_;
};

}  // namespace dlod::test
