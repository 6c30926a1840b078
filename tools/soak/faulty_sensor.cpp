#include "tools/soak/faulty_sensor.hpp"

#include <arpa/inet.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cmath>
#include <stdexcept>
#include <thread>
#include <utility>

#include "driver/pcap_source.hpp"
#include "tools/sim/packet_shift.hpp"

namespace dlod::tools::soak {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::nanoseconds;

/// The sensor sends nothing for so long before it is back; the robot stands meanwhile.
constexpr std::int64_t kRestart_ns = 800'000'000;
/// And then sends for so long, at the least, before the end: whoever waits for a second packet of a new stream before
/// believing in it has one.
constexpr std::int64_t kBack_ns = 2'000'000'000;
constexpr double kBurst_s = 0.15;

int open_socket(const char* address) {
    const int fd = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_in from{};
    from.sin_family = AF_INET;
    ::inet_pton(AF_INET, address, &from.sin_addr);
    if (fd < 0 || ::bind(fd, reinterpret_cast<const sockaddr*>(&from), sizeof from) != 0) {
        throw std::runtime_error(std::string("no UDP socket on ") + address);
    }
    constexpr int kBuffer = 4 << 20;
    ::setsockopt(fd, SOL_SOCKET, SO_SNDBUF, &kBuffer, sizeof kBuffer);
    return fd;
}

void send_to(int fd, std::span<const std::byte> bytes, std::uint16_t port) {
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ::sendto(fd, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
}

}  // namespace

FaultySensor::FaultySensor(FaultySensorOptions options)
    : options_(std::move(options)),
      layout_(options_.sensor.layout()),
      turn_ns_(std::llround(1e9 * options_.sensor.model.frame_period_s)),
      lap_ns_(options_.lap_frames * turn_ns_),
      random_(1),
      socket_(open_socket("127.0.0.2")) {}

FaultySensor::~FaultySensor() {
    ::close(socket_);
}

bool FaultySensor::over() const {
    return stopping_ || Clock::now() - start_ > std::chrono::duration<double>(options_.seconds);
}

void FaultySensor::run() {
    start_ = Clock::now();
    std::thread stranger([this] {
        if (options_.garbage_per_second > 0.0) send_garbage();
    });
    const auto laps_between_restarts =
        std::max<std::int64_t>(1, std::llround(options_.restart_every_s * 1e9 / static_cast<double>(lap_ns_)));
    const auto last_restart_ns = std::llround(1e9 * options_.seconds) - kBack_ns;
    for (std::int64_t lap = 0; !over(); ++lap) {
        const bool due = (lap + 1) % laps_between_restarts == 0;
        send_lap(lap, due && (lap + 1) * lap_ns_ <= last_restart_ns);
    }
    stopping_ = true;
    stranger.join();
}

void FaultySensor::send_lap(std::int64_t lap, bool restart_at_end) {
    driver::PcapSource source(options_.capture);
    std::int64_t first_ns = -1;
    std::uint32_t first_frame_id = 0;
    std::vector<std::byte> bytes;
    std::int64_t counted_turns = 0;
    for (auto batch = source.next(); batch.status == driver::SourceStatus::kPackets && !over(); batch = source.next()) {
        for (const driver::Packet& packet : batch.packets) {
            const bool imu = packet.destination_port == options_.sensor.imu_port;
            if (first_ns < 0) {
                if (imu) continue;
                first_ns = packet.receive_ns;
                first_frame_id = layout_.read_packet_header(packet.data).frame_id;
            }
            const std::int64_t in_lap_ns = packet.receive_ns - first_ns;
            if (restart_at_end && in_lap_ns > lap_ns_ - kRestart_ns) continue;
            std::int64_t due_ns = lap * lap_ns_ + in_lap_ns;
            const double due_s = 1e-9 * static_cast<double>(due_ns);
            const bool bursts_come = options_.burst_every_s > 0.0;
            const double since_burst_s = bursts_come ? std::fmod(due_s, options_.burst_every_s) : kBurst_s;
            if (since_burst_s < kBurst_s) due_ns += std::llround(1e9 * (kBurst_s - since_burst_s));
            std::this_thread::sleep_until(start_ + nanoseconds(due_ns));

            sim::PacketShift shift{.time_ns = lap * lap_ns_, .initializations = restarts_};
            shift.frames = static_cast<std::uint32_t>((lap - restarted_in_lap_) * options_.lap_frames);
            if (restarts_ > 0) shift.frames -= first_frame_id;  // it counts from 0 again
            bytes.assign(packet.data.begin(), packet.data.end());
            if (imu) {
                sim::shift_imu_packet(bytes, shift);
                transmit(bytes, options_.imu_port);
                continue;
            }
            sim::shift_lidar_packet(bytes, layout_, shift);
            pass_lidar(bytes);
            const std::lock_guard lock(mutex_);
            if (bursts_come) totals_.bursts = static_cast<std::uint64_t>(due_s / options_.burst_every_s) + 1;
            totals_.restarts = restarts_;
            if (in_lap_ns / turn_ns_ >= counted_turns) {
                ++counted_turns;
                ++totals_.frames;
            }
        }
    }
    if (!restart_at_end || over()) return;
    ++restarts_;
    restarted_in_lap_ = lap + 1;
}

void FaultySensor::pass_lidar(const std::vector<std::byte>& bytes) {
    const bool lost = random_.chance(options_.loss);
    const bool late = random_.chance(options_.reordering);
    const bool twice = random_.chance(options_.duplication);
    if (!lost && late) {
        late_.push_back({bytes, random_.integer(1, 3)});
    } else if (!lost) {
        transmit(bytes, options_.lidar_port);
        if (twice) transmit(bytes, options_.lidar_port);
    }
    for (Waiting& waiting : late_) {
        if (--waiting.packets_left < 0) transmit(waiting.bytes, options_.lidar_port);
    }
    std::erase_if(late_, [](const Waiting& waiting) { return waiting.packets_left < 0; });
    const std::lock_guard lock(mutex_);
    ++totals_.packets;
    totals_.lost += lost ? 1 : 0;
    totals_.reordered += !lost && late ? 1 : 0;
    totals_.duplicated += !lost && !late && twice ? 1 : 0;
}

void FaultySensor::transmit(const std::vector<std::byte>& bytes, std::uint16_t port) const {
    send_to(socket_, bytes, port);
}

/// Noise of any size, noise of a lidar packet's size, and packets of another sensor that look like this one's.
void FaultySensor::send_garbage() {
    const int fd = open_socket("127.0.0.3");
    sim::Random random(2);
    while (!over()) {
        std::this_thread::sleep_for(std::chrono::duration<double>(1.0 / options_.garbage_per_second));
        const int kind = random.integer(0, 2);
        std::vector<std::byte> bytes(kind == 0 ? static_cast<std::size_t>(random.integer(0, 20'000))
                                               : layout_.packet_bytes());
        for (std::byte& byte : bytes) byte = static_cast<std::byte>(random.bits() & 0xFFU);
        if (kind == 2) {
            driver::PacketHeader header;
            header.serial_number = options_.sensor.serial() + 1;
            header.frame_id = static_cast<std::uint32_t>(random.integer(0, 100'000));
            layout_.write_packet_header(bytes, header);
        }
        send_to(fd, bytes, random.chance(0.9) ? options_.lidar_port : options_.imu_port);
        const std::lock_guard lock(mutex_);
        ++totals_.garbage;
    }
    ::close(fd);
}

SentTotals FaultySensor::totals() const {
    const std::lock_guard lock(mutex_);
    return totals_;
}

}  // namespace dlod::tools::soak
