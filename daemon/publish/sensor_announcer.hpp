// Tells on DLOD_SENSOR which lidar the messages are from.
#pragma once

#include <cstdint>
#include <dlod/sensor_t.hpp>
#include <optional>
#include <string>

#include "daemon/publish/message_sender.hpp"
#include "driver/metadata.hpp"

namespace dlod::daemon {

/// One for each sensor; for one thread.
class SensorAnnouncer {
  public:
    static constexpr std::int64_t kPeriod_ns = 10'000'000'000;

    SensorAnnouncer(MessageBus& bus, const driver::SensorInfo& sensor, const Eigen::Isometry3d& T_base_sensor,
                    const std::string& channel_prefix);

    /// Sends the message at the first call and then every ten seconds.
    /// @param now_ns CLOCK_MONOTONIC @param utime [us] host time
    void announce_if_due(std::int64_t now_ns, std::int64_t utime);

    /// Messages that could not be sent; from any thread.
    std::uint64_t failed() const { return sender_.failed(); }

  private:
    MessageSender sender_;
    std::string channel_;
    sensor_t message_;
    std::optional<std::int64_t> sent_ns_;
};

}  // namespace dlod::daemon
