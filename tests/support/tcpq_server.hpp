// The server of LCM's tcpq, well or ill behaved.
#pragma once

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

namespace dlod::test {

/// On a port of this host's loopback, in a thread of its own, for one client at a time and those that wait behind it.
class TcpqServer {
  public:
    enum class Manners {
        kReads,        ///< takes all that comes
        kNeverReads,   ///< greets its client, and leaves it at that
        kNeverAnswers  ///< not even that: its client waits for the greeting
    };

    explicit TcpqServer(Manners manners) : manners_(manners), listening_(::socket(AF_INET, SOCK_STREAM, 0)) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t length = sizeof address;
        const int small = 4096;  // what a server does not read, its kernel takes little of
        ::setsockopt(listening_, SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
        EXPECT_EQ(::bind(listening_, reinterpret_cast<sockaddr*>(&address), length), 0) << std::strerror(errno);
        EXPECT_EQ(::listen(listening_, 8), 0) << std::strerror(errno);
        ::getsockname(listening_, reinterpret_cast<sockaddr*>(&address), &length);
        port_ = ntohs(address.sin_port);
        thread_ = std::thread([this] { serve(); });
    }
    ~TcpqServer() {
        stopping_ = true;
        thread_.join();
        ::close(listening_);
    }
    TcpqServer(const TcpqServer&) = delete;
    TcpqServer& operator=(const TcpqServer&) = delete;

    std::string url() const { return "tcpq://127.0.0.1:" + std::to_string(port_); }

    /// Messages that have come whole, in order: channel and content.
    std::vector<std::pair<std::string, std::string>> messages() const {
        const std::lock_guard lock(mutex_);
        std::vector<std::pair<std::string, std::string>> found;
        std::size_t place = 8;  // behind the client's greeting
        while (true) {
            const auto type = number_at(place);
            const auto channel = text_at(place + 4);
            if (!type || !channel) return found;
            const auto content = text_at(place + 8 + channel->size());
            if (!content) return found;
            EXPECT_EQ(*type, kPublish);
            place += 12 + channel->size() + content->size();
            found.emplace_back(*channel, *content);
        }
    }

  private:
    static constexpr std::uint32_t kPublish = 1;

    std::optional<std::uint32_t> number_at(std::size_t place) const {
        std::uint32_t number = 0;
        if (place + sizeof number > received_.size()) return std::nullopt;
        std::memcpy(&number, received_.data() + place, sizeof number);
        return ntohl(number);
    }
    /// Its length, then its bytes.
    std::optional<std::string> text_at(std::size_t place) const {
        const auto length = number_at(place);
        if (!length || place + 4 + *length > received_.size()) return std::nullopt;
        return received_.substr(place + 4, *length);
    }
    void serve() {
        while (!stopping_) {
            if (!comes(listening_)) continue;
            const int client = ::accept(listening_, nullptr, nullptr);
            if (manners_ != Manners::kNeverAnswers) {
                const std::array<std::uint32_t, 2> greeting = {htonl(0x287617fa), htonl(0x0100)};
                EXPECT_EQ(::send(client, greeting.data(), sizeof greeting, MSG_NOSIGNAL), sizeof greeting);
            }
            while (!stopping_ && (manners_ != Manners::kReads || read_from(client))) {
                if (manners_ != Manners::kReads) ::poll(nullptr, 0, kPoll_ms);
            }
            ::close(client);
        }
    }
    /// @return false where the client has gone
    bool read_from(int client) {
        if (!comes(client)) return true;
        std::array<char, 65536> buffer;
        const ssize_t bytes = ::recv(client, buffer.data(), buffer.size(), 0);
        if (bytes <= 0) return false;
        const std::lock_guard lock(mutex_);
        received_.append(buffer.data(), static_cast<std::size_t>(bytes));
        return true;
    }
    static bool comes(int socket) {
        pollfd watched{socket, POLLIN, 0};
        return ::poll(&watched, 1, kPoll_ms) > 0;
    }

    static constexpr int kPoll_ms = 20;

    const Manners manners_;
    int listening_;
    std::uint16_t port_ = 0;
    mutable std::mutex mutex_;
    std::string received_;
    std::atomic<bool> stopping_{false};
    std::thread thread_;
};

}  // namespace dlod::test
