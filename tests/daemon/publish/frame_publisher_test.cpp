#include "daemon/publish/frame_publisher.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "daemon/publish/bit_plane.hpp"
#include "tests/support/recording_bus.hpp"

namespace dlod::daemon {
namespace {

using test::RecordingBus;

SensorModel sensor_of(int height, int width) {
    SensorModel sensor;
    sensor.height = height;
    sensor.width = width;
    sensor.column_window_last = width - 1;
    sensor.altitude_rad.resize(static_cast<std::size_t>(height));
    sensor.azimuth_offset_rad.resize(static_cast<std::size_t>(height));
    sensor.pixel_shift.resize(static_cast<std::size_t>(height));
    return sensor;
}

TEST(BitPlane, AgreesWithBitByBit) {
    std::mt19937 random(1);
    for (const std::size_t size : {0U, 1U, 7U, 8U, 9U, 1000U, 1029U}) {
        std::vector<std::uint8_t> labels(size);
        for (auto& label : labels) label = static_cast<std::uint8_t>(random() % 5);
        if (size > 3) labels[3] = 255;
        for (int value = 0; value < 5; ++value) {
            std::vector<std::uint8_t> bits((size + 7) / 8, 0xAA);
            pack_bit_plane(labels, static_cast<std::uint8_t>(value), bits);
            for (std::size_t i = 0; i < 8 * bits.size(); ++i) {
                const bool expected = i < size && labels[i] == value;
                ASSERT_EQ((bits[i / 8] >> (7 - i % 8) & 1) != 0, expected) << "size " << size << ", pixel " << i;
            }
        }
    }
}

TEST(FramePublisher, AMaskOf128By1024IsOneMessage) {
    const SensorModel sensor = sensor_of(128, 1024);
    Frame frame(sensor);
    frame.header.sequence = 7;
    frame.detection.label.fill(static_cast<std::uint8_t>(PixelLabel::kStatic));
    frame.detection.label(2, 9) = static_cast<std::uint8_t>(PixelLabel::kDynamic);
    frame.detection.label(127, 1023) = static_cast<std::uint8_t>(PixelLabel::kUndecided);
    RecordingBus bus;
    FramePublisher publisher(bus, sensor, Eigen::Isometry3d::Identity(), {});
    publisher.publish(frame, 123456);
    const auto masks = bus.decoded<dynamic_mask_t>("DLOD_MASK");
    ASSERT_EQ(masks.size(), 1U);
    const auto& mask = masks[0];
    EXPECT_EQ(mask.utime, 123456);
    EXPECT_EQ(mask.sequence, 7);
    EXPECT_EQ(mask.parts, 1);
    EXPECT_EQ(mask.rows, 128);
    ASSERT_EQ(mask.dynamic.size(), 16384U);
    for (std::size_t i = 0; i < mask.dynamic.size(); ++i) {
        EXPECT_EQ(mask.dynamic[i], i == (2 * 1024 + 9) / 8 ? 0x40 : 0) << i;
        EXPECT_EQ(mask.undecided[i], i == 16383 ? 0x01 : 0) << i;
    }
}

TEST(FramePublisher, LargerMasksGoOutAsPartsOfWholeRows) {
    for (const int width : {2048, 4096}) {
        const SensorModel sensor = sensor_of(128, width);
        Frame frame(sensor);
        for (std::size_t i = 0; i < frame.detection.label.size(); ++i) {
            frame.detection.label[i] =
                static_cast<std::uint8_t>(i % 7 == 0 ? PixelLabel::kDynamic : PixelLabel::kGround);
        }
        RecordingBus bus;
        LcmConfig config;
        config.channel_prefix = "A_RATHER_LONG_PREFIX_";
        FramePublisher publisher(bus, sensor, Eigen::Isometry3d::Identity(), config);
        publisher.publish(frame, 5);
        const auto masks = bus.decoded<dynamic_mask_t>("A_RATHER_LONG_PREFIX_MASK");
        ASSERT_GT(masks.size(), 1U);
        int next_row = 0;
        for (std::size_t part = 0; part < masks.size(); ++part) {
            const auto& mask = masks[part];
            EXPECT_EQ(mask.part, static_cast<int>(part));
            EXPECT_EQ(mask.parts, static_cast<int>(masks.size()));
            EXPECT_EQ(mask.first_row, next_row);
            EXPECT_EQ(mask.utime, 5);
            for (int i = 0; i < mask.rows * width; ++i) {
                const int pixel = mask.first_row * width + i;
                ASSERT_EQ((mask.dynamic[static_cast<std::size_t>(i / 8)] >> (7 - i % 8) & 1) != 0, pixel % 7 == 0);
            }
            next_row += mask.rows;
        }
        EXPECT_EQ(next_row, 128);
    }
}

TEST(FramePublisher, OfTooManyTracksTheFarthestAreLeftOutAndCounted) {
    const SensorModel sensor = sensor_of(16, 512);
    Frame frame(sensor);
    frame.odometry.T_world_sensor.translation() = Eigen::Vector3d(100.0, 0.0, 0.0);
    constexpr int kTracks = 1000;
    for (int i = 0; i < kTracks; ++i) {
        Track track;
        track.id = static_cast<std::uint32_t>(i + 1);
        track.state = DynamicState::kDynamic;
        track.box.center_m = Eigen::Vector3d(static_cast<double>(i), 0.0, 0.0);
        track.covariance(0, 3) = track.covariance(3, 0) = 0.5;
        frame.detection.tracks.push_back(track);
    }
    RecordingBus bus;
    FramePublisher publisher(bus, sensor, Eigen::Isometry3d::Identity(), {});
    publisher.publish(frame, 1);
    const auto messages = bus.decoded<tracks_t>("DLOD_TRACKS");
    ASSERT_EQ(messages.size(), 1U);
    const auto& tracks = messages[0];
    EXPECT_GT(tracks.count, 100);
    EXPECT_EQ(tracks.count + tracks.left_out, kTracks);
    EXPECT_EQ(tracks.tracks[0].id, 101) << "the one at the robot comes first";
    double previous = 0.0;
    for (const auto& track : tracks.tracks) {
        const double distance = std::abs(track.position[0] - 100.0);
        EXPECT_GE(distance, previous);
        previous = distance;
    }
    EXPECT_EQ(tracks.tracks[0].covariance[3], 0.5F);
    EXPECT_EQ(tracks.tracks[0].state, track_t::DYNAMIC);
}

TEST(FramePublisher, AMessageThatIsNotSentIsCounted) {
    const SensorModel sensor = sensor_of(16, 512);
    const Frame frame(sensor);
    RecordingBus bus;
    bus.accepts = false;
    FramePublisher publisher(bus, sensor, Eigen::Isometry3d::Identity(), {});
    publisher.publish(frame, 1);
    EXPECT_EQ(publisher.failed(), 2U);
    EXPECT_EQ(bus.messages.size(), 2U) << "obstacles are off by default";
}

}  // namespace
}  // namespace dlod::daemon
