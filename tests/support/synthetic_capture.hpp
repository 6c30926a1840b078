// A small drive, as packets: for tests of the whole program that need neither recorded data nor the simulator.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace dlod::test {

/// One datagram of the drive.
struct SyntheticPacket {
    std::vector<std::byte> data;
    std::int64_t time_ns = 0;  ///< when it is sent: the firing time of its last column
    std::uint16_t port = 0;
};

/// What a synthetic sensor says of itself, and what its drive is like.
struct SyntheticSensor {
    int rows = 32;
    int columns = 512;
    std::string profile = "RNG15_RFL8_NIR8";
    std::uint64_t serial_number = 123456;
    std::uint32_t init_id = 7;
    std::string firmware = "v2.3.0";
    std::string status = "RUNNING";
    std::uint16_t lidar_port = 7502;
    std::uint16_t imu_port = 7503;
    std::int64_t epoch_ns = 1'700'000'000'000'000'000;  ///< its clock when frame 0 begins
    int first_frame = 0;                                ///< of the capture
    double speed_mps = 1.0;                             ///< along the hall, 24 m from its one end to the other
};

/// A sensor, of 32 x 512 pixels unless said otherwise, at 10 Hz drives at 1 m/s through a hall in which a person walks;
/// every column is fired from where the sensor is at that moment. IMU at 100 Hz.
class SyntheticCapture {
  public:
    static constexpr int kRows = 32;
    static constexpr int kColumns = 512;
    static constexpr std::uint16_t kLidarPort = 7502;
    static constexpr std::uint16_t kImuPort = 7503;

    explicit SyntheticCapture(int frames, const SyntheticSensor& sensor = {});

    /// In order of time.
    const std::vector<SyntheticPacket>& packets() const { return packets_; }
    static std::string metadata(const SyntheticSensor& sensor = {});
    /// Writes drive.pcap and drive.json into the folder; returns the capture's path.
    std::filesystem::path write(const std::filesystem::path& folder) const;

  private:
    SyntheticSensor sensor_;
    std::vector<SyntheticPacket> packets_;
};

/// A folder of its own, removed with all that is in it.
class TemporaryFolder {
  public:
    TemporaryFolder();
    ~TemporaryFolder();
    TemporaryFolder(const TemporaryFolder&) = delete;
    TemporaryFolder& operator=(const TemporaryFolder&) = delete;
    const std::filesystem::path& path() const { return path_; }

  private:
    std::filesystem::path path_;
};

}  // namespace dlod::test
