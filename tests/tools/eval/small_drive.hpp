// A drive small enough to know every score by hand: its truth folder, and the output folder of a run that answers it.
#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "core/types/track.hpp"
#include "tools/eval/truth.hpp"

namespace dlod::tools::test {

/// 20 frames of 4 x 8 pixels at 10 Hz. The sensor drives 1 m/s along a curve; object 1 walks beside it (pixels 0..3),
/// object 2 rests at first and walks from frame 10 on (pixels 4, 5); pixels 6..15 are static, 16..29 ground, 30, 31
/// empty.
struct SmallDrive {
    static constexpr int kFrames = 20;
    static constexpr int kPixels = 32;
    static constexpr double kStart_s = 1700000000.0;

    std::filesystem::path truth_folder, run_folder;  ///< removed by the destructor
    std::vector<Eigen::Isometry3d> T_world_sensor;
    std::vector<std::vector<TruthObject>> objects;
    std::vector<std::vector<std::uint8_t>> labels;

    // What the run says; perfect until a test spoils it. Its world is the first pose's.
    std::vector<Eigen::Isometry3d> run_poses;
    std::vector<std::vector<std::uint8_t>> run_labels;
    std::vector<std::vector<Track>> run_tracks;
    std::vector<Eigen::Vector3d> map;  ///< true world

    SmallDrive();
    ~SmallDrive();
    SmallDrive(const SmallDrive&) = delete;
    SmallDrive& operator=(const SmallDrive&) = delete;

    static double stamp_s(int frame) { return kStart_s + 0.1 * frame + 0.099; }
    static std::int64_t stamp_ns(int frame);

    void write() const;

  private:
    void write_truth() const;
    void write_run() const;
};

}  // namespace dlod::tools::test
