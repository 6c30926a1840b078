// dlod-soak: a sensor on a bad network for as long as one likes, and what a running dlod makes of it, as a table.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "driver/metadata.hpp"
#include "tools/command_line.hpp"
#include "tools/eval/truth.hpp"
#include "tools/soak/accuracy.hpp"
#include "tools/soak/faulty_sensor.hpp"
#include "tools/soak/monitor.hpp"

namespace dlod::tools::soak {
namespace {

struct Options {
    std::string drive;
    std::string reference;
    std::string lcm;
    std::string prefix = "SOAK_";
    double minutes = 5.0;
    int port = 7502;
    FaultySensorOptions faults;
    double most_motion_error = 1.5;
    double most_position_error = 2.0;
    double most_latency_ms = 200.0;
};

struct Row {
    SentTotals sent;  // up to the row's end
    Observation seen;
    PoseErrors errors;
};

struct Latency {
    double p50_ms = 0.0;
    double p99_ms = 0.0;
    double max_ms = 0.0;
};

/// @param name "latency": to the last message of a frame; "pose_latency": to its pose
Latency latency(const status_t& status, const char* name = "latency") {
    const auto found = std::find(status.stage_name.begin(), status.stage_name.end(), name);
    if (found == status.stage_name.end()) return {};
    const auto i = static_cast<std::size_t>(found - status.stage_name.begin());
    return {static_cast<double>(status.stage_p50[i]), static_cast<double>(status.stage_p99[i]),
            static_cast<double>(status.stage_max[i])};
}

long long counter(const status_t& status, const std::string& name) {
    const auto found = std::find(status.counter_name.begin(), status.counter_name.end(), name);
    if (found == status.counter_name.end()) return -1;
    return status.counter_value[static_cast<std::size_t>(found - status.counter_name.begin())];
}

/// Frames that the service says it has left out for want of processor time.
long long dropped(const status_t& status) {
    return std::max(0LL, counter(status, "pipeline_dropped_frames")) + std::max(0LL, counter(status, "dropped_frames"));
}

double megabytes(const status_t& status) {
    return 1e-6 * static_cast<double>(status.memory);
}

void print_head() {
    std::printf("%6s %8s %6s %6s %7s %6s %6s %6s %6s %7s %9s %9s %9s %8s %8s %8s %7s %7s %7s %9s\n", "minute",
                "packets", "lost", "twice", "garbage", "starts", "frames", "poses", "valid", "dropped", "predicted",
                "motion cm", "place cm", "worst cm", "pose p50", "pose p99", "p50 ms", "p99 ms", "max ms", "memory MB");
}

void print_row(double minute, const Row& row, const Row& before) {
    const auto since = [&](std::uint64_t SentTotals::*total) {
        return static_cast<unsigned long>(row.sent.*total - before.sent.*total);
    };
    const auto& o = row.seen;
    const Latency l = latency(o.last_status);
    const Latency pose = latency(o.last_status, "pose_latency");
    std::printf(
        "%6.1f %8lu %6lu %6lu %7lu %6lu %6lu %6lu %6zu %7lld %9lu %9.2f %9.2f %8.2f %8.1f %8.1f %7.1f %7.1f %7.1f "
        "%9.1f\n",
        minute, since(&SentTotals::packets), since(&SentTotals::lost), since(&SentTotals::duplicated),
        since(&SentTotals::garbage), since(&SentTotals::restarts), since(&SentTotals::frames),
        static_cast<unsigned long>(o.poses), o.valid.size(), dropped(o.last_status) - dropped(before.seen.last_status),
        static_cast<unsigned long>(o.predicted), 100.0 * row.errors.motion_m, 100.0 * row.errors.position_m,
        100.0 * row.errors.worst_position_m, pose.p50_ms, pose.p99_ms, l.p50_ms, l.p99_ms, l.max_ms,
        megabytes(o.last_status));
    std::fflush(stdout);
}

/// How much longer the median frame took in the best minute of the second half than in that of the first: other
/// programs hold up some minutes, what grows in the service holds up all of them.
double latency_growth_ms(const std::vector<Row>& rows) {
    if (rows.size() < 2) return 0.0;
    double best_ms[2] = {std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
    for (std::size_t i = 0; i < rows.size(); ++i) {
        double& best = best_ms[2 * i / rows.size()];
        best = std::min(best, latency(rows[i].seen.last_status).p50_ms);
    }
    return best_ms[1] - best_ms[0];
}

/// One line a demand; @return true where all are met.
bool judge(const std::vector<Row>& rows, const PoseErrors& without_faults, const Options& options) {
    bool good = true;
    const auto at_most = [&](const char* what, double value, double bound) {
        const bool met = value <= bound;
        std::printf("%-7s %s: %.2f, at most %.2f\n", met ? "good" : "FAILURE", what, value, bound);
        good = good && met;
    };
    double worst_motion_m = 0.0;
    double worst_position_m = 0.0;
    double worst_p99_ms = 0.0;
    std::uint64_t poses = 0;
    int silent = 0;
    for (const Row& row : rows) {
        worst_motion_m = std::max(worst_motion_m, row.errors.motion_m);
        worst_position_m = std::max(worst_position_m, row.errors.worst_position_m);
        worst_p99_ms = std::max(worst_p99_ms, latency(row.seen.last_status).p99_ms);
        poses += row.seen.poses;
        silent += row.seen.statuses == 0 || row.seen.valid.empty() ? 1 : 0;
    }
    const SentTotals& sent = rows.back().sent;
    const status_t& last = rows.back().seen.last_status;
    at_most("minutes without status or valid pose", silent, 0.0);
    // The one under way at the end, and one at either edge of a restart may be cut off.
    at_most("frames neither published nor counted as dropped",
            static_cast<double>(sent.frames) - static_cast<double>(poses) - static_cast<double>(dropped(last)),
            static_cast<double>(2 + 2 * sent.restarts));
    // Per what the poses are without faults, and what a single lost frame may cost where that is next to nothing.
    constexpr double kMotionFloor_cm = 0.2;
    constexpr double kPositionFloor_cm = 2.0;
    at_most("error of the motion over 1 s in the worst minute, rms, cm", 100.0 * worst_motion_m,
            kMotionFloor_cm + 100.0 * options.most_motion_error * without_faults.motion_m);
    at_most("largest error of a position, cm", 100.0 * worst_position_m,
            kPositionFloor_cm + 100.0 * options.most_position_error * without_faults.worst_position_m);
    at_most("worst p99 of the latency, ms", worst_p99_ms, options.most_latency_ms);
    at_most("growth of the median latency, best minute of the second half to that of the first, ms",
            latency_growth_ms(rows), 10.0);
    // The map and the history fill up at first.
    const std::size_t settled = rows.size() / 2;
    at_most("growth of memory over the second half, %",
            100.0 * (megabytes(last) / std::max(1.0, megabytes(rows[settled].seen.last_status)) - 1.0), 5.0);
    at_most("restarts of the sensor that went unseen",
            std::abs(static_cast<double>(sent.restarts) - static_cast<double>(counter(last, "restarts"))), 0.0);
    std::printf("the same drive without faults, cm: motion %.2f, place %.2f, worst %.2f\n",
                100.0 * without_faults.motion_m, 100.0 * without_faults.position_m,
                100.0 * without_faults.worst_position_m);
    std::printf("counters at the end:");
    for (std::size_t i = 0; i < last.counter_name.size(); ++i) {
        if (last.counter_value[i] != 0) {
            std::printf(" %s %lld,", last.counter_name[i].c_str(), static_cast<long long>(last.counter_value[i]));
        }
    }
    std::printf("\nsent: %lu reordered, %lu bursts\n", static_cast<unsigned long>(sent.reordered),
                static_cast<unsigned long>(sent.bursts));
    return good;
}

int run(const Options& options) {
    const std::string prefix = options.drive;
    FaultySensorOptions faults = options.faults;
    faults.sensor = driver::load_metadata(prefix + ".json");
    const Truth lap(prefix + "_truth");
    faults.capture = prefix + ".pcap";
    faults.lap_frames = static_cast<int>(lap.frames());
    faults.lidar_port = static_cast<std::uint16_t>(options.port);
    faults.imu_port = static_cast<std::uint16_t>(options.port + 1);
    faults.seconds = 60.0 * options.minutes;
    const double lap_s = faults.lap_frames * faults.sensor.model.frame_period_s;
    const PoseErrors without_faults = Accuracy(lap, lap_s, 1).judge(read_tum(options.reference));
    Accuracy accuracy(lap, lap_s, static_cast<int>(faults.seconds / lap_s) + 2);
    Monitor monitor(options.lcm, options.prefix);
    if (!monitor.good()) throw std::runtime_error("LCM cannot be opened at " + options.lcm);
    FaultySensor sensor(std::move(faults));
    std::atomic<bool> sent{false};
    std::thread sender([&] {
        sensor.run();
        sent = true;
    });
    std::vector<Row> rows;
    print_head();
    const auto start = std::chrono::steady_clock::now();
    const int minutes = static_cast<int>(std::ceil(options.minutes));
    for (int minute = 1; minute <= minutes; ++minute) {
        const bool last = minute == minutes;
        const auto end = start + std::chrono::minutes(minute);
        while (!sent && (last || std::chrono::steady_clock::now() < end))
            std::this_thread::sleep_for(std::chrono::milliseconds(100));
        // What is under way, and the status that counts it.
        if (last) std::this_thread::sleep_for(std::chrono::milliseconds(1500));
        Observation seen = monitor.take();
        const PoseErrors errors = accuracy.judge(seen.valid);
        rows.push_back({sensor.totals(), std::move(seen), errors});
        const std::chrono::duration<double, std::ratio<60>> passed = std::chrono::steady_clock::now() - start;
        print_row(passed.count(), rows.back(), rows.size() > 1 ? rows[rows.size() - 2] : Row{});
    }
    sender.join();
    return judge(rows, without_faults, options) ? 0 : 1;
}

}  // namespace
}  // namespace dlod::tools::soak

int main(int argc, char** argv) {
    CLI::App app{
        "Sends a lap of a drive to a running dlod again and again, with loss, reordering, duplicates, bursts, restarts "
        "of "
        "the sensor and garbage from a second sender, and prints minute by minute what comes out. Fails where a demand "
        "at the end is not met. tools/soak.sh does all around it."};
    dlod::tools::soak::Options options;
    app.add_option("drive", options.drive, "DRIVE.pcap, DRIVE.json and DRIVE_truth of dlod-sim --lap")->required();
    app.add_option("--reference", options.reference,
                   "trajectory.tum of dlod replay of the drive: how accurate the poses are without faults")
        ->required();
    app.add_option("--lcm", options.lcm, "LCM provider")->required();
    app.add_option("--prefix", options.prefix, "of dlod's channels; its lcm.utime_source must be sensor")
        ->capture_default_str();
    app.add_option("--minutes", options.minutes)->check(CLI::Range(0.1, 10000.0))->capture_default_str();
    app.add_option("--port", options.port, "dlod's lidar port on this host; IMU: the next one")->capture_default_str();
    app.add_option("--loss", options.faults.loss, "share of the packets")->capture_default_str();
    app.add_option("--duplication", options.faults.duplication, "share of the packets")->capture_default_str();
    app.add_option("--reordering", options.faults.reordering, "share of the packets")->capture_default_str();
    app.add_option("--burst-every", options.faults.burst_every_s, "s; 0: none")->capture_default_str();
    app.add_option("--restart-every", options.faults.restart_every_s, "s; at the end of a lap")->capture_default_str();
    app.add_option("--garbage", options.faults.garbage_per_second, "packets/s; 0: none")->capture_default_str();
    app.add_option("--most-motion-error", options.most_motion_error, "over 1 s, rms, per that of the reference")
        ->capture_default_str();
    app.add_option("--most-position-error", options.most_position_error, "largest, per that of the reference")
        ->capture_default_str();
    app.add_option("--most-latency", options.most_latency_ms, "p99, ms")->capture_default_str();
    if (const auto code = dlod::tools::parse_command_line(app, argc, argv)) return *code;
    try {
        return dlod::tools::soak::run(options);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "dlod-soak: %s\n", error.what());
        return 1;
    }
}
