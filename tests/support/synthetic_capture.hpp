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

/// A sensor of 32 x 512 pixels at 10 Hz drives at 1 m/s through a hall in which a person walks; every column is fired
/// from where the sensor is at that moment. Profile RNG15_RFL8_NIR8, IMU at 100 Hz.
class SyntheticCapture {
  public:
    static constexpr int kRows = 32;
    static constexpr int kColumns = 512;
    static constexpr std::uint16_t kLidarPort = 7502;
    static constexpr std::uint16_t kImuPort = 7503;

    explicit SyntheticCapture(int frames);

    /// In order of time.
    const std::vector<SyntheticPacket>& packets() const { return packets_; }
    static std::string metadata();
    /// Writes drive.pcap and drive.json into the folder; returns the capture's path.
    std::filesystem::path write(const std::filesystem::path& folder) const;

  private:
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
