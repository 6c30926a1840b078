// Sensor time to host time: what `utime` in the messages is made of.
//
// Each packet gives one pair: the sensor's stamp of its last column and the kernel's receive stamp. Their difference is
// the clocks' offset plus the delay of the network and of the kernel's queue, and that delay is never negative. So the
// offset is the lower envelope of the differences, and it drifts slowly with the sensor's oscillator: the filter keeps
// the smallest difference of each short interval, and follows the line under them.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace dlod::daemon {

/// Maps the sensor's clock (whatever its epoch: boot, TAI, UTC) to the host's CLOCK_REALTIME. Deterministic in its
/// inputs; not thread-safe; allocates nothing.
class HostTimeFilter {
  public:
    /// A change of the host's or the sensor's clock that was seen since the last call.
    struct Step {
        bool happened = false;
        std::int64_t by_ns = 0;  ///< host minus sensor time, after minus before
        bool followed = false;   ///< false: utime goes on along the old time scale: it may never go backwards, and
                                 ///< makes up for that when the host's clock is set forward again
    };

    /// @param sensor_ns  sensor time of the packet's last column
    /// @param receive_ns kernel receive stamp, CLOCK_REALTIME
    void add(std::int64_t sensor_ns, std::int64_t receive_ns);

    /// Host time of a sensor time; valid once ready(). Does not depend on the order of calls.
    std::int64_t to_host_ns(std::int64_t sensor_ns) const;

    /// As to_host_ns, and later than every result before it, by half the sensor's own time between the two or more:
    /// for the stamps of successive frames.
    std::int64_t next_stamp_ns(std::int64_t sensor_ns);

    /// A filter for a sensor with another clock, whose stamps go on where this one's end.
    HostTimeFilter for_another_sensor() const;

    bool ready() const { return initialized_; }
    Step take_step();
    double drift_ppm() const { return slope_ * 1e6; }

  private:
    static constexpr std::int64_t kIntervalNs = 1'000'000'000;  // one minimum is kept a second
    static constexpr std::size_t kIntervals = 64;               // over about a minute
    static constexpr std::int64_t kStepNs = 50'000'000;         // no network delay seen on a robot lasts this long...
    static constexpr std::int64_t kStepHoldNs = 2'000'000'000;  // ...for this long
    static constexpr std::int64_t kLongestGapNs = 60'000'000'000;  // between packets, that utime follows
    static constexpr double kMaxSlope = 200e-6;                    // oscillators are within 100 ppm

    struct Minimum {
        double sensor_s;  // since epoch_sensor_ns_
        double offset_s;  // since base_offset_ns_
    };

    void restart(std::int64_t sensor_ns, std::int64_t offset_ns);
    void push(const Minimum& minimum);
    void fit();
    double predicted_offset_s(double sensor_s) const { return intercept_ + slope_ * (sensor_s - pivot_s_); }

    bool initialized_ = false;
    std::int64_t begin_sensor_ns_ = 0;  ///< of the stream: until the hold time is over, all may have been delayed
    std::int64_t last_added_ns_ = 0;    ///< sensor time of the packet added last
    std::int64_t epoch_sensor_ns_ = 0;
    std::int64_t base_offset_ns_ = 0;
    std::array<Minimum, kIntervals> minima_{};
    std::size_t count_ = 0;
    Minimum current_{};
    std::int64_t interval_begin_ns_ = 0;
    double pivot_s_ = 0.0;
    double intercept_ = 0.0;
    double slope_ = 0.0;
    std::int64_t above_since_ns_ = 0;    // sensor time since which every difference has been far above the line
    std::int64_t above_minimum_ns_ = 0;  // smallest of those differences
    bool above_ = false;
    std::int64_t held_back_ns_ = 0;  // a backward step of the host's clock that is not followed
    std::int64_t last_stamp_ns_ = INT64_MIN;
    std::int64_t last_sensor_ns_ = 0;   // of that stamp
    std::int64_t last_receive_ns_ = 0;  // of the packet that was added last then
    std::int64_t receive_ns_ = 0;       // of the packet added last
    bool stepped_ = false;              // since that stamp a clock was set: the sensor's tells no time between
    Step step_;
};

}  // namespace dlod::daemon
