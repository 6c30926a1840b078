#include "tools/sim/truth_writer.hpp"

#include <gtest/gtest.h>

#include <cstdlib>
#include <cstring>
#include <fstream>
#include <iterator>
#include <sstream>

#include "tests/tools/sim/recorded_drive.hpp"

namespace dlod::tools::sim::test {
namespace {

std::string content(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
}

std::vector<std::string> lines(const std::filesystem::path& path) {
    std::istringstream in(content(path));
    std::vector<std::string> result;
    for (std::string line; std::getline(in, line);) result.push_back(line);
    return result;
}

class TruthWriterTest : public ::testing::Test {
  protected:
    void SetUp() override {
        std::string name = (std::filesystem::temp_directory_path() / "dlod-truth-XXXXXX").string();
        ASSERT_NE(mkdtemp(name.data()), nullptr);
        folder_ = name;
        settings_.world.duration_s = 0.3;
        drive_ = record(settings_);
        const Lidar lidar(drive_.sensor, drive_.world, settings_.world.duration_s, {.seed = settings_.world.seed});
        const ImuSimulator imu(drive_.world.robot, drive_.sensor.model, settings_.world.seed, true);
        TruthWriter writer(folder_, lidar, drive_.world);
        for (std::size_t i = 0; i < drive_.scans.size(); ++i) writer.write(drive_.scans[i], drive_.packets[i]);
        writer.finish(imu, settings_.world.duration_s, {.scene = "square", .profile = "any", .faults = "{}"});
    }
    void TearDown() override { std::filesystem::remove_all(folder_); }

    std::filesystem::path folder_;
    DriveSettings settings_;
    RecordedDrive drive_;
};

TEST_F(TruthWriterTest, ImagesHaveARecordAFrame) {
    const std::string labels = content(folder_ / "labels.bin");
    const std::string instances = content(folder_ / "instances.bin");
    const std::string near = content(folder_ / "near.bin");
    const std::size_t pixels = drive_.sensor.model.pixels();
    ASSERT_EQ(labels.size(), 3 * pixels);
    ASSERT_EQ(instances.size(), 6 * pixels);
    ASSERT_EQ(near.size(), 3 * pixels / 8);
    int moving = 0;
    for (std::size_t i = 0; i < labels.size(); ++i) {
        const Scan& scan = drive_.scans[i / pixels];
        const std::uint32_t range = scan.first.range_mm[i % pixels];
        const bool bit = ((static_cast<unsigned char>(near[i / 8]) >> (7 - i % 8)) & 1) != 0;
        ASSERT_EQ(bit, range > 0 && range < 25'000);
        std::uint16_t instance = 0;
        std::memcpy(&instance, instances.data() + 2 * i, 2);
        ASSERT_EQ(labels[i] == 2 || labels[i] == 3, instance > 0 && labels[i] != 1 && labels[i] != 0);
        moving += labels[i] == 2 ? 1 : 0;
    }
    EXPECT_GT(moving, 0);
}

TEST_F(TruthWriterTest, TablesHaveTheirHeadersAndRows) {
    const auto objects = lines(folder_ / "objects.csv");
    EXPECT_EQ(objects[0], "frame,stamp,id,class,cx,cy,cz,yaw,length,width,height,speed,visible_points,ever_moves");
    EXPECT_EQ(objects.size(), 1 + 3 * drive_.world.actors.size());
    const auto packets = lines(folder_ / "packets.csv");
    EXPECT_EQ(packets[0], "frame,frame_id,packet,first_column,first_column_ns,fault");
    EXPECT_EQ(packets.size(), 1U + 3U * 512U / 16U);
    EXPECT_EQ(packets[1], "0,1005,0,0,1700000000000000000,ok");
    const auto imu = lines(folder_ / "imu_truth.csv");
    EXPECT_EQ(imu[0], "stamp,ax,ay,az,gx,gy,gz");
    EXPECT_EQ(imu.size(), 31U);
    EXPECT_TRUE(imu[1].starts_with("1700000000.001300000,"));
    const auto poses = lines(folder_ / "poses_tum.txt");
    ASSERT_EQ(poses.size(), 3U);
    EXPECT_TRUE(poses[0].starts_with("1700000000.099804688 "));
    EXPECT_TRUE(lines(folder_ / "poses_start_tum.txt")[1].starts_with("1700000000.100000000 "));
    EXPECT_TRUE(lines(folder_ / "poses_mid_tum.txt")[0].starts_with("1700000000.050000000 "));
}

TEST_F(TruthWriterTest, MapsAreSortedCellsAsNumpyReadsThem) {
    const std::string map = content(folder_ / "map_static.npy");
    ASSERT_EQ(map.substr(0, 6), "\x93NUMPY");
    std::uint16_t header = 0;
    std::memcpy(&header, map.data() + 8, 2);
    ASSERT_EQ((10 + header) % 64, 0);
    ASSERT_EQ(map[9U + header], '\n');
    const std::size_t points = (map.size() - 10 - header) / 12;
    EXPECT_NE(map.find("'shape': (" + std::to_string(points) + ", 3)"), std::string::npos);
    ASSERT_GT(points, 5000U);
    float first = 0.0F;
    float last = 0.0F;
    std::memcpy(&first, map.data() + 10 + header, 4);
    std::memcpy(&last, map.data() + map.size() - 12, 4);
    EXPECT_LT(first, last);
    EXPECT_NEAR(std::remainder(static_cast<double>(first) - 0.05, 0.1), 0.0, 1e-4);
}

TEST(TruthWriter, NamesTheFolderThatCannotBeMade) {
    const driver::SensorInfo sensor = driver::parse_metadata(make_metadata("OS1-32"), "OS1-32");
    const World world;
    const Lidar lidar(sensor, world, 0.1, {});
    EXPECT_THROW(TruthWriter("/proc/nowhere", lidar, world), std::exception);
}

}  // namespace
}  // namespace dlod::tools::sim::test
