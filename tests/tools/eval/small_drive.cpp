#include "tests/tools/eval/small_drive.hpp"

#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <fstream>
#include <memory>
#include <string>

namespace dlod::tools::test {
namespace {

void write_tum(const std::filesystem::path& path, const std::vector<Eigen::Isometry3d>& poses, double offset_s) {
    std::unique_ptr<FILE, int (*)(FILE*)> out(std::fopen(path.c_str(), "w"), std::fclose);
    for (std::size_t k = 0; k < poses.size(); ++k) {
        const Eigen::Vector3d t = poses[k].translation();
        const Eigen::Quaterniond q(poses[k].linear());
        std::fprintf(out.get(), "%.9f %.9f %.9f %.9f %.12f %.12f %.12f %.12f\n",
                     SmallDrive::stamp_s(static_cast<int>(k)) + offset_s, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(),
                     q.w());
    }
}

void write_bytes(const std::filesystem::path& path, const std::vector<std::vector<std::uint8_t>>& images) {
    std::ofstream out(path, std::ios::binary);
    for (const auto& image : images)
        out.write(reinterpret_cast<const char*>(image.data()), static_cast<std::streamsize>(image.size()));
}

void write_points(std::ofstream& out, const std::vector<Eigen::Vector3d>& points) {
    for (const auto& p : points) {
        const Eigen::Vector3f xyz = p.cast<float>();
        out.write(reinterpret_cast<const char*>(xyz.data()), 3 * sizeof(float));
    }
}

void write_npy(const std::filesystem::path& path, const std::vector<Eigen::Vector3d>& points) {
    std::string header =
        "{'descr': '<f4', 'fortran_order': False, 'shape': (" + std::to_string(points.size()) + ", 3), }";
    header.resize(117, ' ');
    header += '\n';
    std::ofstream out(path, std::ios::binary);
    out.write("\x93NUMPY\x01\x00", 8);
    const auto size = static_cast<std::uint16_t>(header.size());
    out.write(reinterpret_cast<const char*>(&size), 2);
    out << header;
    write_points(out, points);
}

/// A floor of 10 m x 10 m with a point every 0.2 m.
std::vector<Eigen::Vector3d> floor_points() {
    std::vector<Eigen::Vector3d> points;
    for (int i = 0; i < 50; ++i) {
        for (int j = 0; j < 50; ++j) points.emplace_back(0.2 * i + 0.1, 0.2 * j + 0.1, 0.01);
    }
    return points;
}

}  // namespace

std::int64_t SmallDrive::stamp_ns(int frame) {
    return 1700000000LL * 1000000000LL + static_cast<std::int64_t>(frame) * 100000000LL + 99000000LL;
}

SmallDrive::SmallDrive() {
    const auto folder = std::filesystem::temp_directory_path() / ("dlod_eval_" + std::to_string(::getpid()));
    truth_folder = folder / "truth";
    run_folder = folder / "run";
    std::filesystem::create_directories(truth_folder);
    std::filesystem::create_directories(run_folder);
    map = floor_points();
    for (int k = 0; k < kFrames; ++k) {
        const double s = 0.1 * k;
        Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
        T.translate(Eigen::Vector3d(2.0 + s, 3.0 + 0.3 * std::sin(3.0 * s), 1.0));
        T.rotate(Eigen::AngleAxisd(0.4 + 0.5 * s, Eigen::Vector3d::UnitZ()));
        T_world_sensor.push_back(T);
        run_poses.push_back(T_world_sensor.front().inverse() * T);

        TruthObject walks{.id = 1,
                          .center_m = {2.0 + s, 6.0, 0.9},
                          .length_m = 0.6,
                          .width_m = 0.6,
                          .speed_mps = 1.0,
                          .visible_points = 100,
                          .ever_moves = true};
        TruthObject starts{.id = 2,
                           .center_m = {5.0, 2.0 + (k > 10 ? s - 1.0 : 0.0), 0.9},
                           .length_m = 0.6,
                           .width_m = 0.6,
                           .speed_mps = k >= 10 ? 1.0 : 0.0,
                           .visible_points = 80,
                           .ever_moves = true};
        objects.push_back({walks, starts});

        std::vector<std::uint8_t> label(kPixels, 0);
        std::vector<std::uint8_t> run_label(kPixels, 0);
        std::vector<Track> tracks;
        for (std::size_t i = 0; i < 30; ++i) {
            const bool moving = i < 4 || (i < 6 && k >= 10);
            label[i] = i < 6 ? (moving ? 2 : 3) : (i < 16 ? 1 : 4);
            run_label[i] = moving ? 2 : (i < 16 ? 1 : 4);
        }
        labels.push_back(label);
        run_labels.push_back(run_label);
        for (const auto& object : objects.back()) {
            Track track;
            track.id = static_cast<std::uint32_t>(10 + object.id);
            track.state = object.speed_mps > 0.0 ? DynamicState::kDynamic : DynamicState::kStatic;
            track.box.center_m = T_world_sensor.front().inverse() * object.center_m;
            track.box.size_m = {object.length_m, object.width_m, 1.8};
            const Eigen::Vector3d velocity = object.id == 1 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
            track.velocity_mps = T_world_sensor.front().linear().transpose() * (object.speed_mps * velocity);
            tracks.push_back(track);
        }
        run_tracks.push_back(tracks);
    }
}

SmallDrive::~SmallDrive() {
    std::error_code ignored;
    std::filesystem::remove_all(truth_folder.parent_path(), ignored);
}

void SmallDrive::write() const {
    write_truth();
    write_run();
}

void SmallDrive::write_truth() const {
    write_tum(truth_folder / "poses_tum.txt", T_world_sensor, 0.0);
    write_tum(truth_folder / "poses_start_tum.txt", T_world_sensor, -0.098);
    write_bytes(truth_folder / "labels.bin", labels);
    write_bytes(truth_folder / "near.bin", std::vector<std::vector<std::uint8_t>>(kFrames, {0xff, 0xff, 0xff, 0xfc}));
    std::ofstream csv(truth_folder / "objects.csv");
    csv << "frame,stamp,id,class,cx,cy,cz,yaw,length,width,height,speed,visible_points,ever_moves\n";
    for (int k = 0; k < kFrames; ++k) {
        for (const auto& o : objects[static_cast<std::size_t>(k)]) {
            csv << k << ',' << std::to_string(stamp_s(k)) << ',' << o.id << ",person," << o.center_m.x() << ','
                << o.center_m.y() << ',' << o.center_m.z() << ',' << o.yaw_rad << ',' << o.length_m << ',' << o.width_m
                << ",1.8," << o.speed_mps << ',' << o.visible_points << ',' << (o.ever_moves ? 1 : 0) << '\n';
        }
    }
    write_npy(truth_folder / "map_static.npy", floor_points());
    write_npy(truth_folder / "map_moving.npy", {{2.0, 6.0, 0.9}, {3.0, 6.0, 0.9}});
}

void SmallDrive::write_run() const {
    write_tum(run_folder / "trajectory.tum", run_poses, 0.0);
    write_bytes(run_folder / "labels.bin", run_labels);
    std::ofstream frames(run_folder / "frames.csv");
    frames << "seq,frame_id,stamp_ns,valid_columns,points,dynamic_points,pose_valid,latency_ms,ingest_ms,odometry_ms\n";
    std::ofstream tracks(run_folder / "tracks.csv");
    tracks.precision(9);
    tracks << "seq,stamp_ns,id,state,x,y,z,yaw,length,width,height,vx,vy,vz,points,hits,residual\n";
    const char* states[] = {"undefined", "static", "dynamic"};
    for (int k = 0; k < kFrames; ++k) {
        frames << k << ',' << 500 + k << ',' << stamp_ns(k) << ",8,30,4,1,5.0,0.5," << 1.0 + 0.1 * k << '\n';
        for (const auto& t : run_tracks[static_cast<std::size_t>(k)]) {
            const auto& b = t.box;
            tracks << k << ',' << stamp_ns(k) << ',' << t.id << ',' << states[static_cast<int>(t.state)] << ','
                   << b.center_m.x() << ',' << b.center_m.y() << ',' << b.center_m.z() << ',' << b.yaw_rad << ','
                   << b.size_m.x() << ',' << b.size_m.y() << ',' << b.size_m.z() << ',' << t.velocity_mps.x() << ','
                   << t.velocity_mps.y() << ',' << t.velocity_mps.z() << ",100,5,0.1\n";
        }
    }
    std::ofstream pcd(run_folder / "map.pcd", std::ios::binary);
    pcd << "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH " << map.size()
        << "\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " << map.size() << "\nDATA binary\n";
    std::vector<Eigen::Vector3d> in_run_world;
    for (const auto& p : map) in_run_world.push_back(T_world_sensor.front().inverse() * p);
    write_points(pcd, in_run_world);
}

}  // namespace dlod::tools::test
