#include "daemon/output/result_writer.hpp"

#include <gtest/gtest.h>

#include <cstring>
#include <limits>

#include "daemon/output/point_cloud_file.hpp"
#include "tests/support/file_content.hpp"
#include "tests/support/synthetic_capture.hpp"
#include "tests/support/synthetic_frame.hpp"

namespace dlod::daemon {
namespace {

using test::content;

TEST(ResultWriter, WritesTheFormatsToTheLetter) {
    const test::TemporaryFolder folder;
    PipelineFrame frame(test::small_sensor());
    frame.header = {.sequence = 4, .frame_id = 65535, .stamp_ns = 1'700'000'000'000'000'007, .valid_columns = 250};
    frame.odometry.valid = true;
    frame.odometry.T_world_sensor =
        make_pose(so3_exp(Eigen::Vector3d(0.0, 0.0, 0.5)), Eigen::Vector3d(1.5, -2.25, 0.125));
    frame.detection.label.fill(static_cast<std::uint8_t>(PixelLabel::kNoReturn));
    frame.detection.label[5] = static_cast<std::uint8_t>(PixelLabel::kDynamic);
    frame.detection.label[6] = static_cast<std::uint8_t>(PixelLabel::kGround);
    frame.detection.instance.fill(0);
    frame.detection.instance[5] = 70'000;
    frame.detection.dynamic_points = 1;
    Track track;
    track.id = 70'000;
    track.state = DynamicState::kDynamic;
    track.box = {.center_m = {1.0, 2.0, 3.0}, .yaw_rad = 0.5, .size_m = {0.75, 0.5, 1.75}};
    track.velocity_mps = {1.0, 0.0, -0.5};
    track.points = 1;
    track.hits = 9;
    track.residual_m = 0.25;
    frame.detection.tracks = {track};
    frame.latency_ms = 12.3456F;
    frame.times.wall_ms[0] = 1.5F;
    frame.times.cpu_ms[0] = 0.5F;
    {
        ResultWriter writer(folder.path() / "a/b", TimingClock::kCpu);
        writer.write(frame);
        frame.odometry.valid = false;
        frame.detection.tracks.clear();
        ++frame.header.sequence;
        writer.write(frame);
        const std::vector<MapPoint> map = {
            {1.0F, 2.0F, 3.0F}, {std::numeric_limits<float>::quiet_NaN(), 0.0F, 0.0F}, {4.0F, 5.0F, 6.0F}};
        writer.finish(map);
    }
    const auto out = folder.path() / "a/b";
    EXPECT_EQ(
        content(out / "trajectory.tum"),
        "1700000000.000000007 1.500000000 -2.250000000 0.125000000 0.000000000 0.000000000 0.247403959 0.968912422\n");
    const auto frames = content(out / "frames.csv");
    EXPECT_EQ(frames.substr(0, frames.find('\n')),
              "seq,frame_id,stamp_ns,valid_columns,points,dynamic_points,pose_valid,latency_ms,ingest_ms,geometry_ms,"
              "subsampling_ms,ground_ms,segmentation_ms,odometry_ms,detection_ms,tracking_ms,removal_ms,publish_ms,map_"
              "ms,write_ms");
    EXPECT_NE(frames.find("\n4,65535,1700000000000000007,250,2,1,1,12.346,0.500,"), std::string::npos) << frames;
    EXPECT_NE(frames.find("\n5,65535,1700000000000000007,250,2,1,0,"), std::string::npos) << frames;
    EXPECT_EQ(content(out / "tracks.csv"),
              "seq,stamp_ns,id,state,x,y,z,yaw,length,width,height,vx,vy,vz,points,hits,residual\n"
              "4,1700000000000000007,70000,dynamic,1.000000,2.000000,3.000000,0.500000,0.750000,0.500000,1.750000,1."
              "000000,0.000000,"
              "-0.500000,1,9,0.250000\n");
    const std::size_t pixels = frame.detection.label.size();
    const auto labels = content(out / "labels.bin");
    ASSERT_EQ(labels.size(), 2 * pixels);
    EXPECT_EQ(labels[5], 2);
    EXPECT_EQ(labels[pixels + 6], 4);
    const auto instances = content(out / "instances.bin");
    ASSERT_EQ(instances.size(), 2 * 4 * pixels);
    std::uint32_t id = 0;
    std::memcpy(&id, instances.data() + 5 * 4, 4);
    EXPECT_EQ(id, 70'000U);
    const auto map = content(out / "map.pcd");
    EXPECT_NE(map.find("\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n"), std::string::npos);
    const auto data = map.find("\nPOINTS 2\nDATA binary\n");
    ASSERT_NE(data, std::string::npos);
    float xyz[6] = {};
    ASSERT_EQ(map.size() - (data + std::strlen("\nPOINTS 2\nDATA binary\n")), sizeof(xyz));
    std::memcpy(xyz, map.data() + map.size() - sizeof(xyz), sizeof(xyz));
    for (int i = 0; i < 6; ++i) EXPECT_EQ(xyz[i], static_cast<float>(i + 1));
}

TEST(ResultWriter, WhatRoundsToZeroHasNoSign) {
    const test::TemporaryFolder folder;
    PipelineFrame frame(test::small_sensor());
    frame.odometry.valid = true;
    frame.odometry.T_world_sensor.translation() = Eigen::Vector3d(-0.0, -4e-10, -6e-10);
    Track track;
    track.box.center_m = {-4e-7, -6e-7, -0.0};
    frame.detection.tracks = {track};
    ResultWriter writer(folder.path(), TimingClock::kWall);
    writer.write(frame);
    writer.finish({});
    EXPECT_EQ(content(folder.path() / "trajectory.tum").rfind("0.000000000 0.000000000 0.000000000 -0.000000001 ", 0),
              0U)
        << content(folder.path() / "trajectory.tum");
    EXPECT_NE(content(folder.path() / "tracks.csv").find(",0.000000,-0.000001,0.000000,"), std::string::npos)
        << content(folder.path() / "tracks.csv");
}

TEST(ResultWriter, AFolderThatCannotBeMadeIsNamed) {
    try {
        ResultWriter writer("/proc/nowhere/out", TimingClock::kWall);
        FAIL() << "no error";
    } catch (const OutputError& error) {
        EXPECT_NE(std::string(error.what()).find("/proc/nowhere"), std::string::npos) << error.what();
    }
}

TEST(OutputFile, SparseImagesReadBackAsTheyWere) {
    const test::TemporaryFolder folder;
    const std::filesystem::path path = folder.path() / "images.bin";
    std::string expected = "head";
    OutputFile file(path);
    file.write(expected);
    for (const std::size_t size : {std::size_t{0}, std::size_t{100}, std::size_t{4096}, std::size_t{50'000}}) {
        for (const std::size_t first : {std::size_t{0}, size / 3, size}) {
            std::string image(size, '\0');
            for (std::size_t i = first; i < 2 * size / 3; ++i) image[i] = 'x';
            file.write_sparse(std::as_bytes(std::span(image)));
            expected += image;
        }
    }
    file.close();
    EXPECT_EQ(content(path), expected);
}

TEST(OutputFile, AFullDiskIsAnError) {
    if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "no /dev/full here";
    OutputFile file("/dev/full");
    file.write(std::string(100, 'x'));
    EXPECT_THROW(file.close(), OutputError);
    OutputFile large("/dev/full");
    EXPECT_THROW(large.write(std::string(1'000'000, 'x')), OutputError);
}

}  // namespace
}  // namespace dlod::daemon
