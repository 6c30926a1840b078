// Everything that can be configured, with its defaults.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/method_config.hpp"
#include "daemon/output/map_store.hpp"
#include "daemon/publish/message_config.hpp"
#include "daemon/recorder/recording_config.hpp"
#include "driver/body_filter.hpp"
#include "driver/frame_builder.hpp"

namespace dlod::daemon {

/// What to set on the sensor itself; empty: left as it is.
struct ConfigureSensorConfig {
    std::string udp_dest;
    std::string lidar_mode;
    std::string lidar_profile;
    std::string timestamp_mode;

    template <class V>
    void visit(V& v) {
        v.text("udp_dest", udp_dest, "address to which the sensor sends; @auto: this host");
        v.text("lidar_mode", lidar_mode, "columns and rate, say 1024x10");
        v.text("lidar_profile", lidar_profile, "packet profile, say RNG15_RFL8_NIR8");
        v.text("timestamp_mode", timestamp_mode, "the sensor's clock, say TIME_FROM_PTP_1588");
    }
};

/// Where packets come from and how their sender is known.
struct SensorConfig {
    std::string metadata;
    std::string host;
    std::string bind_address;
    std::string multicast_group;
    std::string interface;
    std::string sender;
    int lidar_port = 0;
    int imu_port = 0;
    bool share_ports = false;
    std::string forward_to;
    int receive_buffer_bytes = 16'000'000;
    ConfigureSensorConfig configure;

    template <class V>
    void visit(V& v) {
        v.text("metadata", metadata,
               "file with the sensor's metadata (JSON); replay takes the capture's name with .json when empty");
        v.text("host", host,
               "name or address of the sensor: a live run without metadata file asks it for its metadata over HTTP");
        v.parameter("lidar_port", lidar_port, Range{0, 65535}, "port",
                    "UDP port of lidar packets; 0: as the metadata says");
        v.parameter("imu_port", imu_port, Range{0, 65535}, "port", "UDP port of IMU packets; 0: as the metadata says");
        v.text("bind_address", bind_address, "local address to receive on; empty: every address, IPv4 and IPv6");
        v.text("multicast_group", multicast_group,
               "multicast group to join; empty: the sensor sends to this host alone");
        v.text("interface", interface, "network interface on which the group is joined; empty: the kernel chooses");
        v.text("sender", sender, "only packets from this address are taken; empty: from any");
        v.flag("share_ports", share_ports, "let other programs read the same ports too; needs a multicast group");
        v.text("forward_to", forward_to,
               "address or address:port to which every packet taken is sent on; empty: nowhere");
        v.parameter("receive_buffer_bytes", receive_buffer_bytes, Range{65'536, 1'000'000'000}, "byte",
                    "socket receive buffer to ask for; net.core.rmem_max bounds what the kernel grants");
        v.group("configure", configure,
                "set on the sensor where not in force, which restarts its stream; needs sensor.host");
    }
};

/// Where the sensor sits on the robot.
struct ExtrinsicsConfig {
    std::array<double, 3> translation_m{0.0, 0.0, 0.0};
    std::array<double, 4> rotation_wxyz{1.0, 0.0, 0.0, 0.0};

    Eigen::Isometry3d T_base_sensor() const {
        const auto& q = rotation_wxyz;
        return make_pose(Eigen::Quaterniond(q[0], q[1], q[2], q[3]), Eigen::Vector3d::Map(translation_m.data()));
    }

    template <class V>
    void visit(V& v) {
        v.vector("translation_m", translation_m, Range{-100.0, 100.0}, "m",
                 "position x, y, z of the sensor frame in the base frame");
        v.vector("rotation_wxyz", rotation_wxyz, Range{-1.0, 1.0}, "1",
                 "unit quaternion w, x, y, z that turns sensor into base axes");
    }
};

/// The robot's own body in the sensor's view.
struct RobotBodyConfig {
    std::vector<double> boxes_m;

    /// Six numbers of boxes_m each.
    std::vector<driver::BodyBox> boxes() const {
        std::vector<driver::BodyBox> boxes;
        for (std::size_t i = 0; i + 6 <= boxes_m.size(); i += 6) {
            boxes.push_back({Eigen::Vector3d::Map(&boxes_m[i]), Eigen::Vector3d::Map(&boxes_m[i + 3])});
        }
        return boxes;
    }

    template <class V>
    void visit(V& v) {
        v.list_of("boxes_m", boxes_m, Range{-100.0, 100.0}, "m",
                  "boxes in the base frame in which returns are none, six numbers each: lowest x, y, z, highest x, y, "
                  "z");
    }
};

struct PipelineConfig {
    int threads = 2;
    int waiting_frames = 2;
    std::vector<double> pin_to_cpus;
    int realtime_priority = 0;
    bool lock_memory = false;

    template <class V>
    void visit(V& v) {
        v.parameter("threads", threads, Range{1, 64}, "threads",
                    "threads that run the stages; a live run has one more that reads the socket");
        v.parameter("waiting_frames", waiting_frames, Range{1, 64}, "frames",
                    "live: frames that may wait for the first stage, one more drops the oldest; higher loses less and "
                    "delays more");
        v.list_of("pin_to_cpus", pin_to_cpus, Range{0, 1023}, "CPU",
                  "CPUs that the threads may run on, all of them on any of these; empty: all. Worth it where other "
                  "programs are "
                  "kept off these CPUs, else it only takes choice from the scheduler");
        v.parameter("realtime_priority", realtime_priority, Range{0, 99}, "1",
                    "SCHED_FIFO priority of a live run's threads, before whatever has none; the service has the right "
                    "to it, by "
                    "hand CAP_SYS_NICE is needed; 0: ordinary scheduling");
        v.flag("lock_memory", lock_memory,
               "keep a live run's memory from being paged out, once used; takes neither more memory nor time, and is "
               "worth "
               "it on computers that swap");
    }
};

struct OutputConfig {
    std::string folder;
    int timing = 0;

    template <class V>
    void visit(V& v) {
        v.text("folder", folder,
               "where trajectory, frames, labels, tracks and map are written; of a service as recording.folder; "
               "empty: nowhere");
        v.choice("timing", timing, {"wall", "cpu"},
                 "what the stage columns of frames.csv measure: elapsed time or the thread's CPU time");
    }
};

struct LogConfig {
    int level = 2;

    template <class V>
    void visit(V& v) {
        v.choice("level", level, {"trace", "debug", "info", "warning", "error", "off"},
                 "least severity of what is logged to stderr");
    }
};

struct Config {
    SensorConfig sensor;
    ExtrinsicsConfig extrinsics;
    RobotBodyConfig robot_body;
    driver::FrameBuilderConfig frames;
    PipelineConfig pipeline;
    LcmConfig lcm;
    OutputConfig output;
    MapStoreConfig saved_maps;
    RecordingConfig recording;
    LogConfig log;
    MethodConfig method;

    /// The method's groups stand at the top level beside the daemon's own.
    template <class V>
    void visit(V& v) {
        v.group("sensor", sensor, "where packets come from");
        v.group("extrinsics", extrinsics, "where the sensor sits on the robot: T_base_sensor");
        v.group("robot_body", robot_body, "the robot itself, which the sensor sees");
        v.group("frames", frames, "assembly of packets to frames");
        v.group("pipeline", pipeline, "threads");
        v.group("lcm", lcm, "messages");
        v.group("output", output, "result files");
        v.group("saved_maps", saved_maps, "maps that are kept");
        v.group("recording", recording, "captures of a live run");
        v.group("log", log, "log messages");
        method.visit(v);
    }
};

}  // namespace dlod::daemon
