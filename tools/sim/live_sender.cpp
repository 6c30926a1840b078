#include "tools/sim/live_sender.hpp"

#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <stdexcept>

#include "tools/sim/packet_shift.hpp"

namespace dlod::tools::sim {
namespace {

/// A UDP socket connected to a host's port.
class Outlet {
  public:
    Outlet(const std::string& host, std::uint16_t port) {
        addrinfo hints{};
        hints.ai_socktype = SOCK_DGRAM;
        addrinfo* found = nullptr;
        if (const int error = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &found); error != 0) {
            throw std::runtime_error(host + ": " + gai_strerror(error));
        }
        socket_ = ::socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
        const bool good = socket_ >= 0 && ::connect(socket_, found->ai_addr, found->ai_addrlen) == 0;
        freeaddrinfo(found);
        if (!good) {
            if (socket_ >= 0) ::close(socket_);
            throw std::runtime_error(host + " port " + std::to_string(port) + ": no UDP socket to it");
        }
        constexpr int kBuffer = 4 << 20;
        ::setsockopt(socket_, SOL_SOCKET, SO_SNDBUF, &kBuffer, sizeof(kBuffer));
    }
    ~Outlet() { ::close(socket_); }
    Outlet(const Outlet&) = delete;
    Outlet& operator=(const Outlet&) = delete;

    bool send(const std::vector<std::byte>& bytes) const {
        return ::send(socket_, bytes.data(), bytes.size(), 0) == static_cast<ssize_t>(bytes.size());
    }

  private:
    int socket_ = -1;
};

std::int64_t monotonic_ns() {
    timespec now{};
    clock_gettime(CLOCK_MONOTONIC, &now);
    return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

void sleep_until(std::int64_t time_ns) {
    const timespec at{.tv_sec = time_ns / 1'000'000'000, .tv_nsec = time_ns % 1'000'000'000};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &at, nullptr) != 0) {
    }
}

}  // namespace

LiveResult send_live(std::vector<Datagram>& drive, int turns, const driver::SensorInfo& sensor,
                     const LiveOptions& options, const std::function<void(double)>& progress,
                     const std::function<bool()>& stop) {
    const Outlet lidar(options.host, options.lidar_port);
    const Outlet imu(options.host, options.imu_port);
    const driver::PacketLayout layout = sensor.layout();
    const std::int64_t length_ns = std::llround(turns * sensor.model.frame_period_s * 1e9);
    const PacketShift next_loop{.time_ns = length_ns, .frames = static_cast<std::uint32_t>(turns)};
    const std::int64_t begin_ns = monotonic_ns() + 50'000'000;
    LiveResult result;
    for (int loop = 0; loop < options.loops; ++loop) {
        for (std::size_t i = 0; i < drive.size(); ++i) {
            Datagram& d = drive[i];
            if (loop > 0 && d.imu) shift_imu_packet(d.bytes, next_loop);
            if (loop > 0 && !d.imu) shift_lidar_packet(d.bytes, layout, next_loop);
            const auto due_ns = static_cast<double>(d.send_ns - kEpoch_ns + loop * length_ns) / options.rate;
            const std::int64_t at_ns = begin_ns + std::llround(due_ns);
            sleep_until(at_ns);
            result.late_worst_ms = std::max(result.late_worst_ms, static_cast<double>(monotonic_ns() - at_ns) * 1e-6);
            ++result.datagrams;
            if (!(d.imu ? imu : lidar).send(d.bytes)) ++result.refused;
            if (i % 256 == 0) {
                if (stop()) return result;
                const double share = (loop + static_cast<double>(i) / static_cast<double>(drive.size()));
                progress(share / options.loops);
            }
        }
    }
    return result;
}

}  // namespace dlod::tools::sim
