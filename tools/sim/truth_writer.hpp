// The truth of a drive as files.
#pragma once

#include <cstdint>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "tools/sim/imu_simulator.hpp"
#include "tools/sim/lidar.hpp"
#include "tools/sim/packet_stream.hpp"

namespace dlod::tools::sim {

/// What info.json tells beside counts.
struct DriveDescription {
    std::string scene;
    std::uint64_t seed = 0;
    double speed_mps = 0.0;
    std::string profile;
    std::string faults;  ///< JSON object
    bool noise = true;
    bool rough = false;
    double off_grid_mrad = 0.0;
    bool fragments = false;
};

/// World z up, metres; stamps in the packets' time. Files:
/// - poses_tum.txt, poses_mid_tum.txt, poses_start_tum.txt: `t x y z qx qy qz qw` of the sensor at the last, middle and
///   first column of each frame
/// - labels.bin u8, instances.bin u16: destaggered images a frame; label 0 no return, 1 static, 2 moving now, 3 at rest
///   but moving at another time, 4 ground; decided at the column's time
/// - near.bin: a bit a pixel, most significant first, of returns within 25 m
/// - objects.csv at the last column; packets.csv; imu_truth.csv (without errors, IMU frame)
/// - map_static.npy (labels 1, 3, 4), map_moving.npy (label 2): float32 N x 3, centres of the 0.1 m cells with returns
///   from 0.3 to 45 m
/// Throws std::runtime_error naming the file that cannot be written.
class TruthWriter {
  public:
    TruthWriter(const std::filesystem::path& folder, const Lidar& lidar, const World& world);
    ~TruthWriter();
    TruthWriter(const TruthWriter&) = delete;
    TruthWriter& operator=(const TruthWriter&) = delete;

    /// Turns in order, after the packet stream has cleared what was lost.
    void write(const Scan& scan, const std::vector<PacketRecord>& packets);

    void finish(const ImuSimulator& imu, double duration_s, const DriveDescription& drive);

  private:
    /// Keys of the cells that hold a return.
    class CellSet {
      public:
        void insert(const Vec3& p);
        void compact();
        void write(const std::filesystem::path& path);

      private:
        std::vector<std::uint64_t> keys_;
        std::size_t compacted_ = 0;
    };
    struct File;

    File& open(const std::string& name);
    void write_pose(File& file, double t) const;
    void write_objects(const Scan& scan);
    void write_near(const Scan& scan);

    std::filesystem::path folder_;
    const Lidar& lidar_;
    const World& world_;
    std::vector<std::unique_ptr<File>> files_;
    File* poses_last_;
    File* poses_middle_;
    File* poses_first_;
    File* labels_;
    File* instances_;
    File* near_;
    File* objects_;
    File* packets_;
    CellSet still_cells_;
    CellSet moving_cells_;
    int scans_ = 0;
    std::uint64_t label_counts_[5] = {};
};

}  // namespace dlod::tools::sim
