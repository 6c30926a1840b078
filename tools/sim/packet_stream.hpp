// Scans and IMU readings as the datagrams that a sensor sends, faults included.
#pragma once

#include <string_view>
#include <vector>

#include "driver/metadata.hpp"
#include "tools/sim/datagram.hpp"
#include "tools/sim/faults.hpp"
#include "tools/sim/imu_simulator.hpp"
#include "tools/sim/lidar.hpp"

namespace dlod::tools::sim {

/// What became of a lidar packet, for packets.csv.
struct PacketRecord {
    std::uint32_t frame_id = 0;
    int packet = 0;  ///< counts from 0 within the turn
    int first_column = 0;
    std::int64_t first_column_ns = 0;
    PacketFault fault = PacketFault::kNone;
};

class PacketStream {
  public:
    PacketStream(const driver::SensorInfo& sensor, const ImuSimulator& imu, double duration_s, std::uint64_t seed,
                 const FaultOptions& faults);

    /// Encodes a turn and the IMU readings that fall into it; turns in order. Pixels of columns that will not arrive
    /// are cleared in `scan`, so that the truth knows them as lost.
    void push(Scan& scan);

    /// Datagrams that are due, in the order of their arrival; `all`: at the end, those that were late as well.
    std::vector<Datagram> take(bool all);

    /// Of the last turn.
    const std::vector<PacketRecord>& records() const { return records_; }

  private:
    void encode(const Scan& scan, int first_column, std::uint32_t frame_id, std::uint32_t init_id, bool corrupt_status,
                std::vector<std::byte>& bytes) const;
    void corrupt(std::vector<std::byte>& bytes, int kind, Random& random) const;
    void push_imu(double until_s);
    void add(std::vector<std::byte> bytes, double send_s, bool imu);

    driver::SensorInfo sensor_;
    driver::PacketLayout layout_;
    const ImuSimulator& imu_;
    double duration_s_;
    std::uint64_t seed_;
    FaultOptions faults_;
    std::uint32_t first_frame_id_;
    int next_imu_ = 0;
    double now_s_ = 0.0;
    std::vector<Datagram> pending_;
    std::vector<PacketRecord> records_;
};

}  // namespace dlod::tools::sim
