#include "daemon/status/status_board.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>

namespace dlod::daemon {
namespace {

constexpr std::int64_t kSecond = 1'000'000'000;
/// No packet, or no pose, for so long is a fault of its own.
constexpr std::int64_t kSilence = 2 * kSecond;
/// A loss is reported for so long.
constexpr std::int64_t kLossMemory = 10 * kSecond;

/// Counters that must not rise, and what to do when they do.
struct Loss {
    const char* counter;
    const char* remedy;
    bool for_good = false;  ///< nothing makes it good again: it is not forgotten
};
constexpr Loss kLosses[] = {
    {"pipeline_dropped_frames", "the CPU is too slow: give the service more CPU or threads"},
    {"dropped_frames", "the CPU is too slow: give the service more CPU or threads"},
    {"packets_kernel_drops", "raise net.core.rmem_max and sensor.receive_buffer_bytes"},
    {"lost_packets", "check cable, switch and receive buffer"},
    {"unusable_frames", "too few columns arrive: check the network"},
    {"wrong_size_packets", "the sensor's profile is not that of the metadata: give its present ones, or sensor.host"},
    {"foreign_packets", "another sensor sends here: set sensor.sender, or give the right metadata"},
    {"implausible_packets", "damaged packets arrive"},
    {"damaged_packets", "the network damages packets, or the sensor's mode is not that of the metadata"},
    {"lcm_failed", "LCM messages cannot be sent: check the multicast route, or the server of tcpq"},
    {"recording_write_failed", "packets cannot be recorded: check recording.folder and its disk"},
    {"recording_buffer_full", "the disk is too slow for the recording"},
    {"output_failures", "result files are no longer written: check output.folder and its disk", true},
};

std::int64_t resident_bytes() {
    long total = 0;
    long resident = 0;
    if (std::FILE* file = std::fopen("/proc/self/statm", "re")) {
        if (std::fscanf(file, "%ld %ld", &total, &resident) != 2) resident = 0;
        std::fclose(file);
    }
    return resident * ::sysconf(_SC_PAGESIZE);
}

std::int64_t peak_bytes() {
    rusage usage{};
    ::getrusage(RUSAGE_SELF, &usage);
    return 1024 * static_cast<std::int64_t>(usage.ru_maxrss);
}

const char* health_name(std::int8_t health) {
    switch (health) {
        case status_t::OK:
            return "ok";
        case status_t::WAITING:
            return "waiting";
        case status_t::DEGRADED:
            return "degraded";
        default:
            return "fault";
    }
}

}  // namespace

StatusBoard::StatusBoard(std::string version, std::string sensor, std::int64_t start_ns)
    : start_ns_(start_ns), last_compose_ns_(start_ns) {
    status_.version = std::move(version);
    status_.sensor = std::move(sensor);
    status_.pose_age = -1;
    status_.stages = static_cast<std::int32_t>(kStepCount + 2);
    status_.stage_name.assign(kStepNames.begin(), kStepNames.end());
    status_.stage_name.emplace_back("pose_latency");
    status_.stage_name.emplace_back("latency");
    for (auto* series : {&status_.stage_p50, &status_.stage_p99, &status_.stage_max}) series->resize(kStepCount + 2);
}

void StatusBoard::add(const PipelineFrame& frame, std::int64_t now_ns) {
    const std::lock_guard lock(mutex_);
    for (std::size_t i = 0; i < kStepCount; ++i) steps_[i].add(frame.times.wall_ms[i]);
    pose_latency_.add(frame.pose_latency_ms);
    latency_.add(frame.latency_ms);
    if (frame.odometry.valid) {
        ++poses_;
        last_pose_ns_ = now_ns;
    }
}

status_t StatusBoard::compose(const CounterList& counters, std::int64_t last_packet_ns, std::int64_t now_ns,
                              std::int64_t utime) {
    const std::lock_guard lock_status(status_mutex_);
    previous_counters_ = std::move(counters_);
    counters_ = {counters.begin(), counters.end()};
    status_.utime = utime;
    status_.uptime = (now_ns - start_ns_) / 1000;
    status_.counters = static_cast<std::int32_t>(counters.size());
    status_.counter_name.clear();
    status_.counter_value.clear();
    for (const auto& [name, value] : counters) {
        status_.counter_name.push_back(name);
        status_.counter_value.push_back(static_cast<std::int64_t>(value));
    }
    {
        const std::lock_guard lock(mutex_);
        compose_rates(now_ns);
        compose_stages();
    }
    compose_health(last_packet_ns, now_ns);
    status_.memory = resident_bytes();
    status_.memory_peak = peak_bytes();
    return status_;
}

status_t StatusBoard::answer(const CommandAnswer& answer, std::int64_t utime) {
    const std::lock_guard lock(status_mutex_);
    status_.utime = utime;
    status_.command_id = answer.id;
    status_.command_ok = answer.ok ? 1 : 0;
    status_.command_answer = answer.text;
    return status_;
}

std::uint64_t StatusBoard::rise(const std::string& name) const {
    const auto value = [&](const std::map<std::string, std::uint64_t>& counters) {
        const auto found = counters.find(name);
        return found == counters.end() ? 0 : found->second;
    };
    return std::max(value(counters_), value(previous_counters_)) - value(previous_counters_);
}

void StatusBoard::compose_rates(std::int64_t now_ns) {
    const double seconds = std::max(1e-9 * static_cast<double>(now_ns - last_compose_ns_), 1e-3);
    const auto rate = [&](const char* name) { return static_cast<double>(rise(name)) / seconds; };
    status_.packet_rate = rate("lidar_packets");
    status_.frame_rate = rate("frames");
    status_.pose_rate = static_cast<double>(poses_ - previous_poses_) / seconds;
    status_.pose_age = last_pose_ns_ == 0 ? -1 : (now_ns - last_pose_ns_) / 1000;
    previous_poses_ = poses_;
    last_compose_ns_ = now_ns;
}

void StatusBoard::compose_stages() {
    const auto put = [&](std::size_t i, const LatencyWindow& window) {
        const auto percentiles = window.percentiles();
        status_.stage_p50[i] = percentiles.p50;
        status_.stage_p99[i] = percentiles.p99;
        status_.stage_max[i] = percentiles.max;
    };
    for (std::size_t i = 0; i < kStepCount; ++i) put(i, steps_[i]);
    put(kStepCount, pose_latency_);
    put(kStepCount + 1, latency_);
}

void StatusBoard::compose_health(std::int64_t last_packet_ns, std::int64_t now_ns) {
    std::string losses;
    for (const Loss& loss : kLosses) {
        if (rise(loss.counter) > 0) rose_ns_[loss.counter] = now_ns;
        const auto rose = rose_ns_.find(loss.counter);
        if (rose == rose_ns_.end() || (now_ns - rose->second > kLossMemory && !loss.for_good)) continue;
        losses += fmt::format("{}{}: {}", losses.empty() ? "" : "; ", loss.counter, loss.remedy);
    }
    if (!sensor_trouble_.empty()) losses += (losses.empty() ? "" : "; ") + sensor_trouble_;
    const std::int64_t packet_age_ns = now_ns - (last_packet_ns == 0 ? start_ns_ : last_packet_ns);
    const bool silent = last_packet_ns == 0 || packet_age_ns > kSilence;
    if (silent) {
        packets_since_ns_ = 0;
    } else if (packets_since_ns_ == 0) {
        packets_since_ns_ = now_ns;
    }
    const std::int64_t pose_ns = status_.pose_age < 0 ? 0 : now_ns - 1000 * status_.pose_age;
    if (silent) {
        status_.health = status_t::WAITING;
        status_.health_text = fmt::format(
            "no packets for {} s: {}", packet_age_ns / kSecond,
            sensor_trouble_.empty() ? "check the sensor's power, cable and UDP destination" : sensor_trouble_);
    } else if (last_packet_ns - std::max(pose_ns, packets_since_ns_) > kSilence) {
        // Up to the last packet: while a sensor that was unplugged is not yet silent for long, nothing is lost.
        status_.health = status_t::FAULT;
        status_.health_text = "packets arrive but no valid pose: " + (losses.empty() ? "the odometry is lost" : losses);
    } else {
        status_.health = losses.empty() ? status_t::OK : status_t::DEGRADED;
        status_.health_text = losses;
    }
}

std::string StatusBoard::one_line() const {
    const std::lock_guard lock(status_mutex_);
    std::string line = fmt::format("{}: {:.1f} frames/s, {:.1f} poses/s", health_name(status_.health),
                                   status_.frame_rate, status_.pose_rate);
    if (status_.pose_age >= 0) line += fmt::format(", pose {} ms old", status_.pose_age / 1000);
    if (!status_.health_text.empty()) line += "; " + status_.health_text;
    return line;
}

}  // namespace dlod::daemon
