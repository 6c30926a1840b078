#include "tools/sim/truth_writer.hpp"

#include <algorithm>
#include <cerrno>
#include <cinttypes>
#include <cmath>
#include <cstring>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "core/types/track.hpp"

namespace dlod::tools::sim {
namespace {

constexpr double kCell_m = 0.1;
constexpr double kMapNear_m = 0.3;
constexpr double kMapFar_m = 45.0;
constexpr std::uint32_t kNear_mm = 25'000;

std::int64_t stamp_ns(double t) {
    return kEpoch_ns + std::llround(t * 1e9);
}

}  // namespace

/// A file that tells when it cannot be written.
struct TruthWriter::File {
    explicit File(const std::filesystem::path& where) : path(where), handle(std::fopen(where.c_str(), "wb")) {
        if (handle == nullptr) fail();
    }
    ~File() {
        if (handle != nullptr) std::fclose(handle);
    }
    File(const File&) = delete;
    File& operator=(const File&) = delete;

    [[noreturn]] void fail() const { throw std::runtime_error(path.string() + ": " + std::strerror(errno)); }
    void bytes(const void* data, std::size_t size) {
        if (std::fwrite(data, 1, size, handle) != size) fail();
    }
    void stamp(double t) {
        const std::int64_t ns = stamp_ns(t);
        print("%" PRId64 ".%09" PRId64, ns / 1'000'000'000, ns % 1'000'000'000);
    }
    template <class... T>
    void print(const char* format, T... values) {
        if (std::fprintf(handle, format, values...) < 0) fail();
    }
    void close() {
        std::FILE* h = std::exchange(handle, nullptr);
        if (h != nullptr && std::fclose(h) != 0) fail();
    }

    std::filesystem::path path;
    std::FILE* handle;
};

void TruthWriter::CellSet::insert(const Vec3& p) {
    constexpr std::int64_t kMiddle = std::int64_t{1} << 20;
    std::uint64_t key = 0;
    for (int k = 0; k < 3; ++k) {
        const auto cell = static_cast<std::int64_t>(std::floor(p[k] / kCell_m)) + kMiddle;
        key = (key << 21) | (static_cast<std::uint64_t>(cell) & 0x1FFFFF);
    }
    keys_.push_back(key);
    if (keys_.size() > 2 * compacted_ + 4'000'000) compact();
}

void TruthWriter::CellSet::compact() {
    std::sort(keys_.begin(), keys_.end());
    keys_.erase(std::unique(keys_.begin(), keys_.end()), keys_.end());
    compacted_ = keys_.size();
}

void TruthWriter::CellSet::write(const std::filesystem::path& path) {
    compact();
    File file(path);
    std::string header =
        "{'descr': '<f4', 'fortran_order': False, 'shape': (" + std::to_string(keys_.size()) + ", 3), }";
    // Magic, version and length take 10 bytes; all of it ends at a multiple of 64 with a line feed.
    header.resize((10 + header.size() + 64) / 64 * 64 - 11, ' ');
    header += '\n';
    const auto length = static_cast<std::uint16_t>(header.size());
    file.bytes("\x93NUMPY\x01\x00", 8);
    file.bytes(&length, sizeof(length));
    file.bytes(header.data(), header.size());
    std::vector<float> centres;
    for (const std::uint64_t key : keys_) {
        for (int k = 2; k >= 0; --k) {
            const auto cell = static_cast<std::int64_t>((key >> (21 * k)) & 0x1FFFFF) - (std::int64_t{1} << 20);
            centres.push_back(static_cast<float>((static_cast<double>(cell) + 0.5) * kCell_m));
        }
    }
    file.bytes(centres.data(), centres.size() * sizeof(float));
    file.close();
}

TruthWriter::TruthWriter(const std::filesystem::path& folder, const Lidar& lidar, const World& world)
    : folder_(folder), lidar_(lidar), world_(world) {
    std::filesystem::create_directories(folder);
    poses_last_ = &open("poses_tum.txt");
    poses_middle_ = &open("poses_mid_tum.txt");
    poses_first_ = &open("poses_start_tum.txt");
    labels_ = &open("labels.bin");
    instances_ = &open("instances.bin");
    near_ = &open("near.bin");
    objects_ = &open("objects.csv");
    packets_ = &open("packets.csv");
    objects_->print("frame,stamp,id,class,cx,cy,cz,yaw,length,width,height,speed,visible_points,ever_moves\n");
    packets_->print("frame,frame_id,packet,first_column,first_column_ns,fault\n");
}

TruthWriter::~TruthWriter() = default;

TruthWriter::File& TruthWriter::open(const std::string& name) {
    files_.push_back(std::make_unique<File>(folder_ / name));
    return *files_.back();
}

void TruthWriter::write_pose(File& file, double t) const {
    const Eigen::Isometry3d T = world_.robot.T_world_sensor(t);
    Eigen::Quaterniond q(T.linear());
    if (q.w() < 0.0) q.coeffs() *= -1.0;
    const Vec3 p = T.translation();
    file.stamp(t);
    file.print(" %.9f %.9f %.9f %.12f %.12f %.12f %.12f\n", p.x(), p.y(), p.z(), q.x(), q.y(), q.z(), q.w());
}

void TruthWriter::write(const Scan& scan, const std::vector<PacketRecord>& packets) {
    const int W = lidar_.model().width;
    write_pose(*poses_first_, scan.start_s);
    write_pose(*poses_middle_, scan.start_s + lidar_.column_s(W / 2));
    write_pose(*poses_last_, scan.start_s + lidar_.column_s(W - 1));
    labels_->bytes(scan.label.data(), scan.label.size());
    instances_->bytes(scan.instance.data(), scan.instance.size() * sizeof(std::uint16_t));
    write_near(scan);
    write_objects(scan);
    for (const PacketRecord& p : packets) {
        packets_->print("%d,%" PRIu32 ",%d,%d,%" PRId64 ",%s\n", scan.index, p.frame_id, p.packet, p.first_column,
                        p.first_column_ns, std::string(name_of(p.fault)).c_str());
    }
    // The sensor moves little in a turn: its middle does for the limits of the map.
    const Vec3 sensor = world_.robot.T_world_sensor(scan.start_s + 0.5 * lidar_.turn_s()).translation();
    for (std::size_t i = 0; i < scan.label.size(); ++i) {
        ++label_counts_[scan.label[i]];
        if (scan.label[i] == 0) continue;
        const Vec3 p(static_cast<double>(scan.x[i]), static_cast<double>(scan.y[i]), static_cast<double>(scan.z[i]));
        const double distance = (p - sensor).norm();
        if (distance < kMapNear_m || distance > kMapFar_m) continue;
        const bool moving = scan.label[i] == static_cast<std::uint8_t>(PixelLabel::kDynamic);
        (moving ? moving_cells_ : still_cells_).insert(p);
    }
    ++scans_;
}

void TruthWriter::write_near(const Scan& scan) {
    std::vector<std::uint8_t> bits((scan.label.size() + 7) / 8, 0);
    for (std::size_t i = 0; i < scan.label.size(); ++i) {
        const std::uint32_t range = scan.first.range_mm[i];
        if (range > 0 && range < kNear_mm) bits[i / 8] = static_cast<std::uint8_t>(bits[i / 8] | (0x80U >> (i % 8)));
    }
    near_->bytes(bits.data(), bits.size());
}

void TruthWriter::write_objects(const Scan& scan) {
    std::vector<int> visible(world_.actors.size() + 1, 0);
    for (std::size_t i = 0; i < scan.instance.size(); ++i) ++visible[scan.instance[i]];
    const double t = scan.start_s + lidar_.column_s(lidar_.model().width - 1);
    for (std::size_t a = 0; a < world_.actors.size(); ++a) {
        const Actor& actor = *world_.actors[a];
        const OrientedBox box = actor.bounds(t, world_.shapes);
        objects_->print("%d,", scan.index);
        objects_->stamp(t);
        objects_->print(",%zu,%s,%.4f,%.4f,%.4f,%.5f,%.3f,%.3f,%.3f,%.4f,%d,%d\n", a + 1, actor.kind().c_str(),
                        box.center_m.x(), box.center_m.y(), box.center_m.z(), box.yaw_rad, box.size_m.x(),
                        box.size_m.y(), box.size_m.z(), actor.speed(t), visible[a + 1], lidar_.ever_moves(a) ? 1 : 0);
    }
}

void TruthWriter::finish(const ImuSimulator& imu, double duration_s, const DriveDescription& drive) {
    File& readings = open("imu_truth.csv");
    readings.print("stamp,ax,ay,az,gx,gy,gz\n");
    for (int i = 0; ImuSimulator::time_s(i) < duration_s; ++i) {
        const ImuReading r = imu.truth(ImuSimulator::time_s(i));
        readings.stamp(ImuSimulator::time_s(i));
        const Vec3& a = r.acceleration_mps2;
        const Vec3& g = r.angular_velocity_radps;
        readings.print(",%.6f,%.6f,%.6f,%.6f,%.6f,%.6f\n", a.x(), a.y(), a.z(), g.x(), g.y(), g.z());
    }
    still_cells_.write(folder_ / "map_static.npy");
    moving_cells_.write(folder_ / "map_moving.npy");

    const SensorModel& model = lidar_.model();
    const auto triple = [](const Vec3& v) { return nlohmann::json{v.x(), v.y(), v.z()}; };
    nlohmann::json info{{"scene", drive.scene},
                        {"seed", drive.seed},
                        {"speed_mps", drive.speed_mps},
                        {"frames", scans_},
                        {"height", model.height},
                        {"width", model.width},
                        {"profile", drive.profile},
                        {"noise", drive.noise},
                        {"rough", drive.rough},
                        {"off_grid_mrad", drive.off_grid_mrad},
                        {"motion_distortion", true},
                        {"fragment", drive.fragments},
                        {"faults", nlohmann::json::parse(drive.faults)},
                        {"movers", world_.actors.size()},
                        {"acc_bias", triple(imu.acceleration_bias())},
                        {"gyro_bias", triple(imu.gyroscope_bias())},
                        {"label_counts", label_counts_}};
    info["points"] = label_counts_[1] + label_counts_[2] + label_counts_[3] + label_counts_[4];
    const std::string text = info.dump(1) + "\n";
    open("info.json").bytes(text.data(), text.size());
    for (auto& file : files_) file->close();
}

}  // namespace dlod::tools::sim
