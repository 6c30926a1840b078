#include "daemon/clock/host_time_filter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace dlod::daemon {

void HostTimeFilter::restart(std::int64_t sensor_ns, std::int64_t offset_ns) {
    initialized_ = true;
    epoch_sensor_ns_ = sensor_ns;
    base_offset_ns_ = offset_ns;
    interval_begin_ns_ = sensor_ns;
    count_ = 0;
    current_ = {0.0, 0.0};
    pivot_s_ = intercept_ = slope_ = 0.0;
    above_ = false;
}

void HostTimeFilter::add(std::int64_t sensor_ns, std::int64_t receive_ns) {
    // At least by so much the host's clock was set back, where that is more than nothing.
    const std::int64_t set_back_ns = std::exchange(receive_ns_, receive_ns) - receive_ns;
    // What is held back is added to the host's clock as if it had never been set back.
    const std::int64_t offset_ns = receive_ns + held_back_ns_ - sensor_ns;
    if (!initialized_) {
        begin_sensor_ns_ = last_added_ns_ = sensor_ns;
        restart(sensor_ns, offset_ns);
        return;
    }
    const double sensor_s = static_cast<double>(sensor_ns - epoch_sensor_ns_) * 1e-9;
    const double offset_s = static_cast<double>(offset_ns - base_offset_ns_) * 1e-9;
    const double excess_s = offset_s - predicted_offset_s(sensor_s);
    const bool sensor_went_back = sensor_ns < last_added_ns_ - kStepNs;
    last_added_ns_ = sensor_ns;

    if (excess_s < -static_cast<double>(kStepNs) * 1e-9) {
        // Earlier than physics allows: the host's clock was set back, or the sensor's forward.
        const auto by_ns = static_cast<std::int64_t>(std::llround(excess_s * 1e9));
        const std::int64_t age_ns = sensor_ns - begin_sensor_ns_;
        if (-by_ns <= kStepHoldNs && age_ns >= 0 && age_ns <= kStepHoldNs) {
            // Or all before it were delayed: a stream often begins with a burst.
            restart(sensor_ns, offset_ns);
            return;
        }
        const bool goes_back = set_back_ns > 0 && last_stamp_ns_ != INT64_MIN;
        step_ = {true, by_ns, !goes_back};
        stepped_ = true;
        // A sensor that was set forward meanwhile does not take utime along.
        if (goes_back) held_back_ns_ += std::min(-by_ns, set_back_ns + kLongestGapNs);
        restart(sensor_ns, receive_ns + held_back_ns_ - sensor_ns);
        return;
    }
    if (excess_s > static_cast<double>(kStepNs) * 1e-9) {
        // Either a delay, which passes, or a step, which stays; a sensor that starts anew counts from the beginning.
        if (!above_ || sensor_went_back) {
            above_ = true;
            above_since_ns_ = sensor_ns;
            above_minimum_ns_ = offset_ns;
        }
        above_minimum_ns_ = std::min(above_minimum_ns_, offset_ns);
        if (!sensor_went_back && sensor_ns - above_since_ns_ < kStepHoldNs) return;
        const std::int64_t by_ns = std::llround(excess_s * 1e9);
        // What was held back of an earlier step is let go: utime comes nearer to the host's time without going back.
        const std::int64_t let_go_ns = sensor_went_back ? 0 : std::min(held_back_ns_, by_ns);
        held_back_ns_ -= let_go_ns;
        step_ = {true, by_ns, let_go_ns < by_ns};
        stepped_ = true;
        restart(sensor_ns, above_minimum_ns_ - let_go_ns);
        return;
    }
    above_ = false;

    if (sensor_ns - interval_begin_ns_ >= kIntervalNs) {
        push(current_);
        interval_begin_ns_ = sensor_ns;
        current_ = {sensor_s, offset_s};
        fit();
    } else if (offset_s - predicted_offset_s(sensor_s) < current_.offset_s - predicted_offset_s(current_.sensor_s)) {
        current_ = {sensor_s, offset_s};
        if (count_ < 2) fit();
    }
}

void HostTimeFilter::push(const Minimum& minimum) {
    if (count_ == kIntervals) {
        std::move(minima_.begin() + 1, minima_.end(), minima_.begin());
        --count_;
    }
    minima_[count_++] = minimum;
}

void HostTimeFilter::fit() {
    if (count_ < 2) {
        // No time for a drift to show: the least delayed packet so far.
        pivot_s_ = current_.sensor_s;
        intercept_ = count_ == 1 ? std::min(current_.offset_s, minima_[0].offset_s) : current_.offset_s;
        slope_ = 0.0;
        return;
    }
    // The line under the minima that comes closest to them: the edge of their lower convex hull above the mean time.
    double mean_s = 0.0;
    for (std::size_t i = 0; i < count_; ++i) mean_s += minima_[i].sensor_s;
    mean_s /= static_cast<double>(count_);
    std::array<std::size_t, kIntervals> hull{};
    std::size_t size = 0;
    for (std::size_t i = 0; i < count_; ++i) {
        const auto turns_down = [&](std::size_t a, std::size_t b) {
            return (minima_[b].offset_s - minima_[a].offset_s) * (minima_[i].sensor_s - minima_[a].sensor_s) >=
                   (minima_[i].offset_s - minima_[a].offset_s) * (minima_[b].sensor_s - minima_[a].sensor_s);
        };
        while (size >= 2 && turns_down(hull[size - 2], hull[size - 1])) --size;
        hull[size++] = i;
    }
    std::size_t edge = 0;
    while (edge + 2 < size && minima_[hull[edge + 1]].sensor_s < mean_s) ++edge;
    const Minimum& a = minima_[hull[edge]];
    const Minimum& b = minima_[hull[edge + 1]];
    // A short history cannot tell drift from delay: the slope is trusted as its base grows.
    const double base_s = minima_[count_ - 1].sensor_s - minima_[0].sensor_s;
    const double trust = std::min(1.0, base_s / 20.0);
    slope_ = std::clamp(trust * (b.offset_s - a.offset_s) / (b.sensor_s - a.sensor_s), -kMaxSlope, kMaxSlope);
    pivot_s_ = a.sensor_s;
    intercept_ = a.offset_s;
    for (std::size_t i = 0; i < count_; ++i) {
        intercept_ = std::min(intercept_, minima_[i].offset_s - slope_ * (minima_[i].sensor_s - pivot_s_));
    }
}

std::int64_t HostTimeFilter::to_host_ns(std::int64_t sensor_ns) const {
    const double sensor_s = static_cast<double>(sensor_ns - epoch_sensor_ns_) * 1e-9;
    return sensor_ns + base_offset_ns_ + static_cast<std::int64_t>(std::llround(predicted_offset_s(sensor_s) * 1e9));
}

std::int64_t HostTimeFilter::next_stamp_ns(std::int64_t sensor_ns) {
    std::int64_t stamp = to_host_ns(sensor_ns);
    if (last_stamp_ns_ != INT64_MIN) {
        // A correction downwards is made up for little by little: who divides by the time between two stamps gets
        // something sensible.
        const std::int64_t between_ns = stepped_ ? receive_ns_ - last_receive_ns_ : sensor_ns - last_sensor_ns_;
        const std::int64_t since_ns = std::clamp<std::int64_t>(between_ns, 0, kStepHoldNs);
        stamp = std::max(stamp, last_stamp_ns_ + std::max<std::int64_t>(since_ns / 2, 1000));  // utime: microseconds
    }
    last_stamp_ns_ = stamp;
    last_sensor_ns_ = sensor_ns;
    last_receive_ns_ = receive_ns_;
    stepped_ = false;
    return stamp;
}

HostTimeFilter HostTimeFilter::for_another_sensor() const {
    HostTimeFilter filter;
    filter.held_back_ns_ = held_back_ns_;
    filter.last_stamp_ns_ = last_stamp_ns_;
    filter.last_receive_ns_ = last_receive_ns_;
    filter.receive_ns_ = receive_ns_;
    filter.stepped_ = true;
    return filter;
}

HostTimeFilter::Step HostTimeFilter::take_step() {
    const Step step = step_;
    step_ = {};
    return step;
}

}  // namespace dlod::daemon
