// dlod-sim: simulated drives with their truth, as captures or live over UDP.
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>

#include "driver/network_address.hpp"
#include "driver/pcap_writer.hpp"
#include "tools/command_line.hpp"
#include "tools/sim/drive.hpp"
#include "tools/sim/live_sender.hpp"
#include "tools/sim/sensor_metadata.hpp"
#include "tools/sim/truth_writer.hpp"

namespace dlod::tools::sim {
namespace {

std::atomic<bool> interrupted{false};

void interrupt(int) {
    interrupted = true;
}

struct Options {
    std::string scene;
    SceneOptions world;
    std::string out;
    std::string name;
    std::string sensor = "OS0-128";
    std::string metadata;
    std::string profile;
    std::string mode;
    int frames = 0;
    bool no_noise = false;
    bool rough = false;
    double off_grid_mrad = 0.0;
    bool start_moving = false;
    bool no_wobble = false;
    bool fragments = false;
    std::string movers = "all";
    std::string live;
    LiveOptions live_options;
    int threads = 2;
    FaultOptions faults;
    std::vector<std::string> gaps;
    std::vector<std::string> sectors;
    std::string imu = "good";
    std::string imu_fault;
    std::string clock_step;
};

const std::map<std::string, ImuFault> kImuFaults{{"good", ImuFault::kNone},     {"off", ImuFault::kOff},
                                                 {"silent", ImuFault::kSilent}, {"stuck", ImuFault::kStuck},
                                                 {"spikes", ImuFault::kSpikes}, {"axes", ImuFault::kAxes},
                                                 {"scale", ImuFault::kScale}};

/// Two numbers with a colon between.
std::pair<double, double> parse_pair(const std::string& text, const char* option) {
    std::istringstream in(text);
    double a = 0.0;
    double b = 0.0;
    char colon = 0;
    if (!(in >> a >> colon >> b) || colon != ':' || !in.eof()) {
        throw std::invalid_argument(std::string(option) + " " + text + ": two numbers with a colon are needed");
    }
    return {a, b};
}

std::string read_file(const std::string& path) {
    std::ifstream in(path, std::ios::binary);
    if (!in) throw std::runtime_error(path + ": cannot be read");
    return {std::istreambuf_iterator<char>(in), {}};
}

/// A bar on a terminal, silence elsewhere.
void show_progress(const char* what, double share) {
    if (isatty(STDERR_FILENO) == 0) return;
    constexpr int kWidth = 40;
    const int done = static_cast<int>(share * kWidth);
    std::cerr << '\r' << what << " [" << std::string(static_cast<std::size_t>(done), '#')
              << std::string(static_cast<std::size_t>(kWidth - done), ' ') << "] " << static_cast<int>(100.0 * share)
              << " %" << (share >= 1.0 ? "\n" : "") << std::flush;
}

std::string describe(const FaultOptions& f) {
    nlohmann::json j = nlohmann::json::object();
    if (f.loss > 0.0) j["loss"] = f.loss;
    if (f.duplication > 0.0) j["duplication"] = f.duplication;
    if (f.reordering > 0.0) j["reordering"] = f.reordering;
    if (f.corruption > 0.0) j["corruption"] = f.corruption;
    if (!f.gaps_s.empty()) j["gaps_s"] = f.gaps_s;
    if (!f.restarts_s.empty()) j["restarts_s"] = f.restarts_s;
    if (!f.sectors_deg.empty()) j["sectors_deg"] = f.sectors_deg;
    for (const auto& [name, fault] : kImuFaults) {
        if (f.imu == fault && fault != ImuFault::kNone) j["imu"] = name;
    }
    if (f.imu_fault_s) j["imu_fault_s"] = *f.imu_fault_s;
    if (f.clock_step_s) j["clock_step_s"] = *f.clock_step_s;
    return j.dump();
}

void add_options(CLI::App& app, Options& o) {
    std::vector<std::string> names;
    std::ostringstream summaries;
    summaries << "Scenes:\n";
    for (const SceneInfo& s : scenes()) {
        names.emplace_back(s.name);
        summaries << "  " << std::left << std::setw(27) << s.name << " " << s.summary << "\n";
    }
    app.footer(summaries.str());
    app.add_option("scene", o.scene, "see below")->required()->check(CLI::IsMember(names));
    app.add_option("--out", o.out, "folder for NAME.pcap, NAME.json and NAME_truth/");
    app.add_option("--name", o.name, "name of the drive; default: the scene");
    app.add_option("--seed", o.world.seed, "another seed, another drive; the same seed, the same bytes")
        ->capture_default_str();
    app.add_option("--speed", o.world.robot.speed_mps, "of the robot, m/s")
        ->check(CLI::Range(0.0, 20.0))
        ->capture_default_str();
    auto* duration = app.add_option("--duration", o.world.duration_s, "seconds")
                         ->check(CLI::Range(0.05, 36000.0))
                         ->capture_default_str();
    app.add_option("--frames", o.frames, "turns of the sensor, instead of seconds")
        ->check(CLI::Range(1, 1000000))
        ->excludes(duration);
    app.add_option("--movers", o.movers, "all, or none: nobody is there")
        ->check(CLI::IsMember({"all", "none"}))
        ->capture_default_str();
    app.add_option("--crowd", o.world.crowd, "so many people stand and walk close around the robot's start")
        ->check(CLI::Range(0, 200))
        ->capture_default_str();
    app.add_flag("--buses", o.world.buses, "street: all that overtakes the robot is buses, close by")
        ->capture_default_str();
    app.add_flag("--start-moving", o.start_moving,
                 "the robot is in motion when the drive starts; else it stands for 1 s");
    app.add_flag("--lap", o.world.robot.lap, "one lap, ending as it began: the drive can be sent again and again");
    app.add_flag("--no-wobble", o.no_wobble, "no pitch, roll and bob of a walking robot");
    app.add_option("--sensor-height", o.world.robot.sensor_height_m, "above the ground, m")
        ->check(CLI::Range(0.2, 5.0))
        ->capture_default_str();
    app.add_option("--kick", o.world.robot.kicks_s, "the robot is kicked at these times (s), about 2 g");
    app.add_option("--fast-turn", o.world.robot.turns_s, "it turns about itself at these times (s), 5 rad/s");

    app.add_option("--sensor", o.sensor, "a made-up sensor: OS0, OS1 or OS2 with rows, such as OS1-64")
        ->capture_default_str();
    app.add_option("--metadata", o.metadata, "metadata of the sensor (JSON) instead")
        ->check(CLI::ExistingFile)
        ->excludes("--sensor");
    app.add_option("--profile", o.profile, "lidar profile, such as RNG15_RFL8_NIR8; default: as in the metadata");
    app.add_option("--mode", o.mode, "columns and rate, such as 2048x10; default: as in the metadata");
    app.add_flag("--no-noise", o.no_noise, "exact ranges, no dropouts, no mixed pixels, a perfect IMU");
    app.add_flag("--rough", o.rough,
                 "as outdoors: leaves let beams through and flutter, beams are off from their calibration by some "
                 "millimetres and hundredths of a degree, stray returns")
        ->excludes("--no-noise");
    app.add_option(
           "--off-grid", o.off_grid_mrad,
           "as a recording of another lidar that was put into an Ouster's grid: single points are off from their "
           "pixel's direction by up to this, in azimuth and altitude, mrad")
        ->check(CLI::Range(0.0, 20.0));
    app.add_flag("--fragments", o.fragments, "the capture holds IPv4 fragments instead of jumbo frames");

    app.add_option("--loss", o.faults.loss, "share of the lidar packets that are lost")->check(CLI::Range(0.0, 1.0));
    app.add_option("--duplication", o.faults.duplication, "share that comes twice")->check(CLI::Range(0.0, 1.0));
    app.add_option("--reordering", o.faults.reordering, "share that comes one to three packets late")
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--corruption", o.faults.corruption, "share that is cut, overwritten, foreign or invalid")
        ->check(CLI::Range(0.0, 1.0));
    app.add_option("--gap", o.gaps, "nothing comes from second FROM on, for LENGTH seconds")->type_name("FROM:LENGTH");
    app.add_option("--restart", o.faults.restarts_s, "the sensor restarts at these times (s)");
    app.add_option("--missing-sector", o.sectors, "columns between two encoder angles are invalid, degrees")
        ->type_name("FROM:TO");
    app.add_option("--imu", o.imu,
                   "off: none; silent: ends after 40 %; stuck: one value after 30 %; axes: wrong ones; scale: half as "
                   "much again")
        ->check(CLI::IsMember(&kImuFaults))
        ->capture_default_str();
    app.add_option("--imu-fault", o.imu_fault, "the IMU is in this state from second FROM on, for LENGTH seconds only")
        ->type_name("FROM:LENGTH");
    app.add_option("--clock-step", o.clock_step,
                   "the sensor's clock jumps by so many seconds; the truth keeps the time")
        ->type_name("AT:BY");

    app.add_option("--live", o.live, "send over UDP at true rate; the ports are the metadata's, or PORT and PORT + 1")
        ->type_name("HOST[:PORT]");
    app.add_option("--loop", o.live_options.loops, "send the drive so many times")
        ->check(CLI::Range(1, 1000000))
        ->capture_default_str();
    app.add_option("--rate", o.live_options.rate, "send so many times faster")
        ->check(CLI::Range(0.01, 100.0))
        ->capture_default_str();
    app.add_option("--threads", o.threads, "for the ray casting; the outcome is the same")
        ->check(CLI::Range(1, 64))
        ->capture_default_str();
}

/// HOST, HOST:PORT or [IPv6]:PORT.
void read_live(Options& o, const driver::SensorInfo& sensor) {
    o.live_options.lidar_port = sensor.lidar_port;
    o.live_options.imu_port = sensor.imu_port;
    o.live_options.host = o.live;
    const std::size_t colon = o.live.rfind(':');
    const bool one_colon = colon != std::string::npos && (o.live.find(':') == colon || o.live[colon - 1] == ']');
    if (one_colon) {
        o.live_options.host = o.live.substr(0, colon);
        const int port = std::atoi(o.live.c_str() + colon + 1);
        if (port < 1 || port > 65534) throw std::invalid_argument("--live " + o.live + ": the port must be 1 to 65534");
        o.live_options.lidar_port = static_cast<std::uint16_t>(port);
        o.live_options.imu_port = static_cast<std::uint16_t>(port + 1);
    }
    std::erase_if(o.live_options.host, [](char c) { return c == '[' || c == ']'; });
}

void prepare(Options& o) {
    if (o.out.empty() && o.live.empty()) throw std::invalid_argument("--out or --live is needed: where is it to go?");
    if (o.name.empty()) o.name = o.scene;
    for (const std::string& gap : o.gaps) o.faults.gaps_s.push_back(parse_pair(gap, "--gap"));
    for (const std::string& sector : o.sectors) {
        o.faults.sectors_deg.push_back(parse_pair(sector, "--missing-sector"));
    }
    o.faults.imu = kImuFaults.at(o.imu);
    if (!o.imu_fault.empty()) o.faults.imu_fault_s = parse_pair(o.imu_fault, "--imu-fault");
    if (!o.clock_step.empty()) o.faults.clock_step_s = parse_pair(o.clock_step, "--clock-step");
    std::sort(o.faults.restarts_s.begin(), o.faults.restarts_s.end());
    o.world.movers = o.movers == "all";
    o.world.robot.wobble = !o.no_wobble;
    if (o.start_moving) o.world.robot.standing_s = 0.0;
}

int run(Options& o) {
    prepare(o);
    std::string json = o.metadata.empty() ? make_metadata(o.sensor) : read_file(o.metadata);
    if (!o.profile.empty()) json = with_profile(json, o.profile);
    if (!o.mode.empty()) json = with_mode(json, o.mode);
    const driver::SensorInfo sensor = driver::parse_metadata(json, o.metadata.empty() ? o.sensor : o.metadata);
    const double turn_s = sensor.model.frame_period_s;
    const int turns = o.frames > 0 ? o.frames : std::max(1, static_cast<int>(std::lround(o.world.duration_s / turn_s)));
    o.world.duration_s = turns * turn_s;
    if (!o.live.empty()) read_live(o, sensor);

    const auto began = std::chrono::steady_clock::now();
    const auto scene = std::find_if(scenes().begin(), scenes().end(), [&](const auto& s) { return s.name == o.scene; });
    const World world = scene->build(o.world);
    const Lidar lidar(
        sensor, world, o.world.duration_s,
        {.seed = o.world.seed, .noise = !o.no_noise, .rough = o.rough, .off_grid_rad = 1e-3 * o.off_grid_mrad});
    const ImuSimulator imu(world.robot, sensor.model, o.world.seed, !o.no_noise);
    PacketStream stream(sensor, imu, o.world.duration_s, o.world.seed, o.faults);

    std::optional<TruthWriter> truth;
    std::optional<driver::PcapWriter> pcap;
    const std::filesystem::path folder = o.out;
    if (!o.out.empty()) {
        std::filesystem::create_directories(folder);
        std::ofstream(folder / (o.name + ".json"), std::ios::binary) << json;
        truth.emplace(folder / (o.name + "_truth"), lidar, world);
        driver::PcapWriterOptions options;
        if (o.fragments) options.mtu = 1500;
        pcap.emplace(folder / (o.name + ".pcap"), options);
    }
    std::vector<Datagram> kept;
    run_drive(world, lidar, stream, turns, o.threads,
              [&](const Scan& scan, const std::vector<PacketRecord>& records, const std::vector<Datagram>& due) {
                  if (truth) truth->write(scan, records);
                  for (const Datagram& d : due) {
                      const std::uint16_t port = d.imu ? sensor.imu_port : sensor.lidar_port;
                      if (pcap && !pcap->write({.data = d.bytes,
                                                .receive_ns = d.send_ns,
                                                .sender_address = driver::ipv4_address(127, 0, 0, 2),
                                                .sender_port = port,
                                                .destination_port = port})) {
                          throw std::runtime_error(pcap->error());
                      }
                  }
                  if (!o.live.empty()) kept.insert(kept.end(), due.begin(), due.end());
                  show_progress("simulating", (scan.index + 1.0) / turns);
                  if (interrupted) throw std::runtime_error("interrupted");
              });
    if (truth) {
        truth->finish(imu, o.world.duration_s,
                      {.scene = o.scene,
                       .seed = o.world.seed,
                       .speed_mps = o.world.robot.speed_mps,
                       .profile = sensor.profile_name,
                       .faults = describe(o.faults),
                       .noise = !o.no_noise,
                       .rough = o.rough,
                       .off_grid_mrad = o.off_grid_mrad,
                       .fragments = o.fragments});
    }
    if (pcap && !pcap->flush()) throw std::runtime_error(pcap->error());
    const std::chrono::duration<double> took = std::chrono::steady_clock::now() - began;
    std::cerr << o.scene << ", seed " << o.world.seed << ": " << turns << " frames of " << sensor.model.height << " x "
              << sensor.model.width << ", " << world.actors.size() << " movable objects, simulated in " << took.count()
              << " s\n";
    if (!o.out.empty()) std::cerr << "wrote " << (folder / o.name).string() << ".{pcap,json} and _truth/\n";
    if (!o.live.empty()) {
        const LiveResult sent = send_live(
            kept, turns, sensor, o.live_options, [](double share) { show_progress("sending", share); },
            [] { return interrupted.load(); });
        std::cerr << "sent " << sent.datagrams << " datagrams to " << o.live_options.host << ", " << sent.refused
                  << " refused, at most " << sent.late_worst_ms << " ms late\n";
    }
    return 0;
}

}  // namespace
}  // namespace dlod::tools::sim

int main(int argc, char** argv) {
    using namespace dlod::tools::sim;
    CLI::App app{"Simulates a drive with an Ouster lidar through a scene, with its full truth."};
    Options options;
    add_options(app, options);
    if (const auto code = dlod::tools::parse_command_line(app, argc, argv)) return *code;
    std::signal(SIGINT, interrupt);
    std::signal(SIGTERM, interrupt);
    try {
        return run(options);
    } catch (const std::invalid_argument& error) {  // of the command line
        std::cerr << "dlod-sim: " << error.what() << "\n";
        return 2;
    } catch (const std::exception& error) {
        std::cerr << "dlod-sim: " << error.what() << "\n";
        return 1;
    }
}
