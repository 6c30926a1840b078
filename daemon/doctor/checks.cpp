#include "daemon/doctor/checks.hpp"

#include <netinet/in.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/statvfs.h>
#include <sys/timex.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <string>

#include "daemon/publish/lcm_url.hpp"
#include "daemon/sensor/sensor_client.hpp"

namespace dlod::daemon {
namespace {

using Verdict = Check::Verdict;

/// A socket that closes itself.
class Socket {
  public:
    Socket() : descriptor_(::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0)) {}
    ~Socket() {
        if (descriptor_ >= 0) ::close(descriptor_);
    }
    Socket(const Socket&) = delete;
    Socket& operator=(const Socket&) = delete;
    int get() const { return descriptor_; }

  private:
    int descriptor_;
};

std::string megabytes(std::uint64_t bytes) {
    return std::to_string(bytes >> 20U) + " MiB";
}

std::filesystem::path nearest_existing(const std::filesystem::path& directory) {
    std::error_code error;
    std::filesystem::path path = std::filesystem::absolute(directory, error);
    while (!std::filesystem::exists(path, error) && path.has_relative_path()) path = path.parent_path();
    return path;
}

std::uint64_t bytes_of_files_in(const std::filesystem::path& directory) {
    std::uint64_t bytes = 0;
    std::error_code error;
    for (std::filesystem::directory_iterator entry(directory, error), end; !error && entry != end;
         entry.increment(error)) {
        std::error_code gone;
        const auto size = entry->file_size(gone);  // of what is no file: an error
        if (!gone) bytes += size;
    }
    return bytes;
}

}  // namespace

Check check_receive_buffer(int wanted_bytes) {
    Check check{"receive buffer", Verdict::kGood, "", ""};
    const Socket socket;
    ::setsockopt(socket.get(), SOL_SOCKET, SO_RCVBUF, &wanted_bytes, sizeof wanted_bytes);
    int granted = 0;
    socklen_t length = sizeof granted;
    if (::getsockopt(socket.get(), SOL_SOCKET, SO_RCVBUF, &granted, &length) != 0) {
        return {check.name, Verdict::kFailure, std::string("no UDP socket: ") + std::strerror(errno),
                "allow AF_INET sockets"};
    }
    granted /= 2;  // the kernel doubles what it is asked for, socket(7)
    check.finding = std::to_string(granted) + " of " + std::to_string(wanted_bytes) + " bytes granted";
    if (granted < wanted_bytes) {
        check.verdict = Verdict::kWarning;
        check.remedy = "sudo sysctl -w net.core.rmem_max=" + std::to_string(wanted_bytes);
    }
    return check;
}

Check check_multicast(const std::string& lcm_url) {
    Check check{"LCM multicast", Verdict::kGood, "", ""};
    const auto group = multicast_group_of(lcm_url);
    if (!group) {
        return {check.name, Verdict::kWarning, "'" + lcm_url + "' is no multicast URL: nothing to check",
                "lcm.url: udpm://239.255.76.67:7667?ttl=1"};
    }
    const auto local = source_address_for(*group);
    if (!local) {
        return {check.name, Verdict::kFailure,
                "no route to " + driver::to_string(group->endpoint.address) + ": " + std::strerror(errno),
                "sudo ip route add 224.0.0.0/4 dev INTERFACE (with no network: sudo ip link set lo multicast on; "
                "sudo ip route add 224.0.0.0/4 dev lo)"};
    }
    check.finding = "messages leave by " + driver::to_string(*local) + " with ttl " + std::to_string(group->ttl);
    if (group->ttl == 0) {
        check.finding += ": they stay on this host";
        check.remedy = "for subscribers on other hosts: lcm.url with ?ttl=1";
    }
    return check;
}

Check check_realtime_priority(int priority) {
    Check check{"real-time priority", Verdict::kGood, "", ""};
    if (priority == 0) {
        check.finding = "not configured";
        return check;
    }
    sched_param before{};
    int policy = ::sched_getscheduler(0);
    ::sched_getparam(0, &before);
    sched_param wanted{};
    wanted.sched_priority = priority;
    if (::sched_setscheduler(0, SCHED_FIFO, &wanted) != 0) {
        return {check.name, Verdict::kWarning,
                "SCHED_FIFO " + std::to_string(priority) + " refused: " + std::strerror(errno),
                "run as the systemd service, or: sudo prlimit --rtprio=" + std::to_string(priority) + " --pid $$"};
    }
    ::sched_setscheduler(0, policy, &before);
    check.finding = "SCHED_FIFO " + std::to_string(priority) + " granted";
    return check;
}

Check check_locked_memory(bool configured) {
    Check check{"locked memory", Verdict::kGood, "", ""};
    if (!configured) {
        check.finding = "not configured";
        return check;
    }
    rlimit limit{};
    ::getrlimit(RLIMIT_MEMLOCK, &limit);
    constexpr rlim_t kNeeded = 512U << 20U;
    if (limit.rlim_cur != RLIM_INFINITY && limit.rlim_cur < kNeeded && ::geteuid() != 0) {
        return {check.name, Verdict::kWarning, "only " + megabytes(limit.rlim_cur) + " may be locked",
                "LimitMEMLOCK=infinity in the service, or: sudo prlimit --memlock=unlimited --pid $$"};
    }
    check.finding = "allowed";
    return check;
}

Check check_clock_synchronised() {
    Check check{"clock", Verdict::kGood, "", ""};
    timex state{};
    const int result = ::adjtimex(&state);
    if (result == -1 || result == TIME_ERROR || (state.status & STA_UNSYNC) != 0) {
        return {check.name, Verdict::kWarning, "not synchronised: stamps will not agree with other hosts'",
                "sudo timedatectl set-ntp true (or chrony, or ptp4l with phc2sys)"};
    }
    check.finding = "synchronised, estimated error " + std::to_string(state.esterror) + " us";
    return check;
}

Check check_disk(const std::filesystem::path& directory, std::uint64_t wanted_bytes,
                 const std::optional<InstalledService>& service) {
    Check check{"disk", Verdict::kGood, "", ""};
    const std::filesystem::path there = nearest_existing(directory);
    struct statvfs space {};
    if (::statvfs(there.c_str(), &space) != 0) {
        return {check.name, Verdict::kFailure, there.string() + ": " + std::strerror(errno),
                "sudo mkdir -p " + directory.string()};
    }
    if (!std::filesystem::is_directory(there)) {
        return {check.name, Verdict::kFailure, there.string() + " is no folder",
                "name another folder than " + directory.string()};
    }
    if (service && !service->may_write(directory)) {
        return {check.name, Verdict::kWarning,
                directory.string() + " is outside of " + service->state_directory.string() + ", where " +
                    service->unit + " may write",
                "name a folder in there, by a relative path, or let the service in: sudo systemctl edit " +
                    service->unit + ", [Service], ReadWritePaths=" + directory.string() +
                    ", and a User= who may write there"};
    }
    if (!service && ::access(there.c_str(), W_OK) != 0) {
        return {check.name, Verdict::kFailure, there.string() + " is not writable",
                "sudo chown $USER " + there.string() + " (the service has a directory of its own)"};
    }
    const std::uint64_t free_bytes = static_cast<std::uint64_t>(space.f_bavail) * space.f_frsize;
    check.finding = megabytes(free_bytes) + " free in " + there.string();
    if (free_bytes + bytes_of_files_in(directory) < wanted_bytes) {
        check.verdict = Verdict::kWarning;
        check.remedy =
            "free at least " + megabytes(wanted_bytes) + " in " + directory.string() + ", or record fewer files";
    }
    return check;
}

Check check_sensor(const std::string& host, const std::string& metadata,
                   const std::optional<InstalledService>& service) {
    Check check{"sensor", Verdict::kGood, "", ""};
    if (host.empty() && metadata.empty()) {
        return {"sensor", Verdict::kFailure, "none is named: neither sensor.host nor sensor.metadata are configured",
                "sensor.host: the sensor's name or address, in the configuration; doctor reads the file after -c"};
    }
    if (!metadata.empty() && service && !service->may_see(metadata)) {
        return {check.name, Verdict::kFailure, service->unit + " does not see " + metadata,
                "sudo install -m 644 " + metadata + " -t /etc/dlod, and name that in sensor.metadata"};
    }
    if (host.empty()) {
        check.finding = "not asked: metadata come from " + metadata;
        return check;
    }
    try {
        SensorClient(host, std::chrono::seconds(2)).fetch_metadata();
        check.finding = host + " answers";
    } catch (const SensorError& error) {
        check.verdict = Verdict::kFailure;
        check.finding = error.what();
        check.remedy = "ping " + host + "; check power, cable and the address in sensor.host";
    }
    return check;
}

}  // namespace dlod::daemon
