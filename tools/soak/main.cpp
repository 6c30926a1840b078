// dlod-soak: a sensor on a bad network for as long as one likes, and what a running dlod makes of it, as a table.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <exception>
#include <string>
#include <thread>
#include <vector>

#include "driver/metadata.hpp"
#include "tools/soak/faulty_sensor.hpp"
#include "tools/soak/monitor.hpp"
#include "tools/soak/truth_path.hpp"

namespace dlod::tools::soak {
namespace {

struct Options {
    std::string drive;
    std::string lcm;
    std::string prefix = "SOAK_";
    double minutes = 5.0;
    int port = 7502;
    FaultySensorOptions faults;
    double most_error_m = 0.1;
    double most_latency_ms = 200.0;
};

struct Row {
    SentTotals sent;  // up to the row's end
    Observation seen;
};

float latency(const status_t& status, const std::vector<float>& percentiles) {
    const auto found = std::find(status.stage_name.begin(), status.stage_name.end(), "latency");
    if (found == status.stage_name.end()) return 0.0F;
    return percentiles[static_cast<std::size_t>(found - status.stage_name.begin())];
}

long long counter(const status_t& status, const std::string& name) {
    const auto found = std::find(status.counter_name.begin(), status.counter_name.end(), name);
    if (found == status.counter_name.end()) return -1;
    return status.counter_value[static_cast<std::size_t>(found - status.counter_name.begin())];
}

double megabytes(const status_t& status) {
    return 1e-6 * static_cast<double>(status.memory);
}

void print_head() {
    std::printf("%6s %8s %6s %6s %7s %6s %7s %6s %6s %9s %8s %8s %8s %8s %8s %9s\n", "minute", "packets", "lost",
                "twice", "garbage", "starts", "frames", "poses", "valid", "predicted", "rms cm", "max cm", "p50 ms",
                "p99 ms", "max ms", "memory MB");
}

void print_row(double minute, const Row& row, const SentTotals& before) {
    const auto since = [](std::uint64_t now, std::uint64_t then) { return static_cast<unsigned long>(now - then); };
    const auto& s = row.sent;
    const auto& o = row.seen;
    const double rms_m = o.valid > 0 ? std::sqrt(o.sum_squared_m2 / static_cast<double>(o.valid)) : 0.0;
    std::printf("%6.1f %8lu %6lu %6lu %7lu %6lu %7lu %6lu %6lu %9lu %8.2f %8.2f %8.1f %8.1f %8.1f %9.1f\n", minute,
                since(s.packets, before.packets), since(s.lost, before.lost), since(s.duplicated, before.duplicated),
                since(s.garbage, before.garbage), since(s.restarts, before.restarts), since(s.frames, before.frames),
                static_cast<unsigned long>(o.poses), static_cast<unsigned long>(o.valid),
                static_cast<unsigned long>(o.predicted), 100.0 * rms_m, 100.0 * o.worst_error_m,
                static_cast<double>(latency(o.last_status, o.last_status.stage_p50)),
                static_cast<double>(latency(o.last_status, o.last_status.stage_p99)),
                static_cast<double>(latency(o.last_status, o.last_status.stage_max)), megabytes(o.last_status));
    std::fflush(stdout);
}

/// One line a demand; @return true where all are met.
bool judge(const std::vector<Row>& rows, const Options& options) {
    bool good = true;
    const auto demand = [&](bool met, const char* what, double value, double bound) {
        std::printf("%-7s %s: %.2f, at most %.2f\n", met ? "good" : "FAILURE", what, value, bound);
        good = good && met;
    };
    const auto at_most = [&](const char* what, double value, double bound) {
        demand(value <= bound, what, value, bound);
    };
    double worst_m = 0.0;
    double worst_p99_ms = 0.0;
    std::uint64_t poses = 0;
    std::uint64_t silent = 0;
    for (const Row& row : rows) {
        worst_m = std::max(worst_m, row.seen.worst_error_m);
        worst_p99_ms =
            std::max(worst_p99_ms, static_cast<double>(latency(row.seen.last_status, row.seen.last_status.stage_p99)));
        poses += row.seen.poses;
        silent += row.seen.statuses == 0 || row.seen.valid == 0 ? 1 : 0;
    }
    const SentTotals& sent = rows.back().sent;
    const status_t& last = rows.back().seen.last_status;
    at_most("minutes without status or valid pose", static_cast<double>(silent), 0.0);
    // The one under way at the end, and one at either edge of a restart may be cut off.
    at_most("frames without a pose message", static_cast<double>(sent.frames) - static_cast<double>(poses),
            static_cast<double>(2 + 2 * sent.restarts));
    at_most("largest position error, cm", 100.0 * worst_m, 100.0 * options.most_error_m);
    at_most("worst p99 of the latency, ms", worst_p99_ms, options.most_latency_ms);
    // The map and the history fill up at first.
    const std::size_t settled = rows.size() / 2;
    at_most("growth of memory over the second half, %",
            100.0 * (megabytes(last) / std::max(1.0, megabytes(rows[settled].seen.last_status)) - 1.0), 5.0);
    at_most("restarts of the sensor that went unseen",
            std::abs(static_cast<double>(sent.restarts) - static_cast<double>(counter(last, "restarts"))), 0.0);
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
    const TruthPath truth(prefix + "_truth/poses_tum.txt", std::llround(1e9 * faults.sensor.model.frame_period_s));
    faults.capture = prefix + ".pcap";
    faults.lap_frames = truth.frames();
    faults.lidar_port = static_cast<std::uint16_t>(options.port);
    faults.imu_port = static_cast<std::uint16_t>(options.port + 1);
    faults.seconds = 60.0 * options.minutes;
    Monitor monitor(options.lcm, options.prefix, truth);
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
    for (int minute = 1; !sent; ++minute) {
        const auto end = start + std::chrono::minutes(minute);
        while (!sent && std::chrono::steady_clock::now() < end)
            std::this_thread::sleep_for(std::chrono::milliseconds(100));
        // What is under way, and the status that counts it.
        if (sent) std::this_thread::sleep_for(std::chrono::milliseconds(1500));
        const SentTotals before = rows.empty() ? SentTotals{} : rows.back().sent;
        rows.push_back({sensor.totals(), monitor.take()});
        const std::chrono::duration<double, std::ratio<60>> minutes = std::chrono::steady_clock::now() - start;
        print_row(minutes.count(), rows.back(), before);
    }
    sender.join();
    return judge(rows, options) ? 0 : 1;
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
    app.add_option("--most-error", options.most_error_m, "m")->capture_default_str();
    app.add_option("--most-latency", options.most_latency_ms, "p99, ms")->capture_default_str();
    CLI11_PARSE(app, argc, argv);
    try {
        return dlod::tools::soak::run(options);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "dlod-soak: %s\n", error.what());
        return 1;
    }
}
