#include "daemon/output/result_writer.hpp"

#include <algorithm>
#include <cmath>
#include <initializer_list>
#include <iterator>

#include "daemon/output/point_cloud_file.hpp"

namespace dlod::daemon {
namespace {

std::filesystem::path created(const std::filesystem::path& folder) {
    std::error_code error;
    std::filesystem::create_directories(folder, error);
    if (error)
        throw OutputError(fmt::format("{}: cannot create the output folder: {}", folder.string(), error.message()));
    return folder;
}

const char* state_name(DynamicState state) {
    switch (state) {
        case DynamicState::kStatic:
            return "static";
        case DynamicState::kDynamic:
            return "dynamic";
        case DynamicState::kUndefined:
            break;
    }
    return "undefined";
}

template <class T>
std::span<const std::byte> bytes_of(const Image<T>& image) {
    return std::as_bytes(std::span(image.data(), image.size()));
}

/// Appends the separator and the value, for each; what rounds to zero has no sign.
void append_fixed(fmt::memory_buffer& line, char separator, int decimals, std::initializer_list<double> values) {
    const double half_of_last = 0.5 * std::pow(10.0, -decimals);
    for (const double value : values) {
        fmt::format_to(std::back_inserter(line), "{}{:.{}f}", separator, std::abs(value) <= half_of_last ? 0.0 : value,
                       decimals);
    }
}

std::string_view text_of(const fmt::memory_buffer& buffer) {
    return {buffer.data(), buffer.size()};
}

}  // namespace

ResultWriter::ResultWriter(const std::filesystem::path& folder, TimingClock clock)
    : folder_(created(folder)),
      clock_(clock),
      trajectory_(folder_ / "trajectory.tum"),
      frames_(folder_ / "frames.csv"),
      labels_(folder_ / "labels.bin"),
      instances_(folder_ / "instances.bin"),
      tracks_(folder_ / "tracks.csv") {
    frames_.write("seq,frame_id,stamp_ns,valid_columns,points,dynamic_points,pose_valid,latency_ms");
    for (const char* name : kStepNames) frames_.write(fmt::format(",{}_ms", name));
    frames_.write("\n");
    tracks_.write("seq,stamp_ns,id,state,x,y,z,yaw,length,width,height,vx,vy,vz,points,hits,residual\n");
}

void ResultWriter::write(PipelineFrame& frame) {
    {
        const StepTimer timer(frame.times, Step::kWrite);
        if (frame.odometry.valid) write_pose(frame);
        labels_.write(bytes_of(frame.detection.label));
        instances_.write_sparse(bytes_of(frame.detection.instance));
        write_tracks(frame);
    }
    write_row(frame);
}

void ResultWriter::write_pose(const Frame& frame) {
    const Eigen::Vector3d t = frame.odometry.T_world_sensor.translation();
    const Eigen::Quaterniond q(frame.odometry.T_world_sensor.linear());
    line_.clear();
    fmt::format_to(std::back_inserter(line_), "{}.{:09}", frame.header.stamp_ns / 1'000'000'000,
                   frame.header.stamp_ns % 1'000'000'000);
    append_fixed(line_, ' ', 9, {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()});
    line_.push_back('\n');
    trajectory_.write(text_of(line_));
}

void ResultWriter::write_tracks(const Frame& frame) {
    line_.clear();
    for (const Track& track : frame.detection.tracks) {
        const auto& box = track.box;
        fmt::format_to(std::back_inserter(line_), "{},{},{},{}", frame.header.sequence, frame.header.stamp_ns, track.id,
                       state_name(track.state));
        append_fixed(line_, ',', 6,
                     {box.center_m.x(), box.center_m.y(), box.center_m.z(), box.yaw_rad, box.size_m.x(), box.size_m.y(),
                      box.size_m.z(), track.velocity_mps.x(), track.velocity_mps.y(), track.velocity_mps.z()});
        fmt::format_to(std::back_inserter(line_), ",{},{}", track.points, track.hits);
        append_fixed(line_, ',', 6, {track.residual_m});
        line_.push_back('\n');
    }
    tracks_.write(text_of(line_));
}

void ResultWriter::write_row(const PipelineFrame& frame) {
    const auto& header = frame.header;
    const auto* label = frame.detection.label.data();
    const auto no_return = static_cast<std::uint8_t>(PixelLabel::kNoReturn);
    const auto points = static_cast<std::ptrdiff_t>(frame.detection.label.size()) -
                        std::count(label, label + frame.detection.label.size(), no_return);
    line_.clear();
    fmt::format_to(std::back_inserter(line_), "{},{},{},{},{},{},{},{:.3f}", header.sequence, header.frame_id,
                   header.stamp_ns, header.valid_columns, points, frame.detection.dynamic_points,
                   frame.odometry.valid ? 1 : 0, frame.latency_ms);
    for (const float ms : clock_ == TimingClock::kWall ? frame.times.wall_ms : frame.times.cpu_ms) {
        fmt::format_to(std::back_inserter(line_), ",{:.3f}", ms);
    }
    line_.push_back('\n');
    frames_.write(text_of(line_));
}

void ResultWriter::finish(std::span<const MapPoint> map) {
    for (OutputFile* file : {&trajectory_, &frames_, &labels_, &instances_, &tracks_}) file->close();
    OutputFile map_file(folder_ / "map.pcd");
    write_pcd(map_file, map);
    map_file.close();
}

}  // namespace dlod::daemon
