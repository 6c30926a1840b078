#include "driver/imu_queue.hpp"

#include <algorithm>

namespace dlod::driver {

std::uint64_t ImuQueue::push(const ImuSample& sample) {
    std::uint64_t rejected = 0;
    const auto earlier = [](const ImuSample& a, const ImuSample& b) { return a.stamp_ns < b.stamp_ns; };
    auto position = std::upper_bound(samples_.begin(), samples_.end(), sample, earlier);
    if (position != samples_.begin() && std::prev(position)->stamp_ns == sample.stamp_ns) return 1;
    if (samples_.size() == kCapacity) {
        ++rejected;
        if (position == samples_.begin()) return rejected;
        samples_.erase(samples_.begin());
        --position;
    }
    samples_.insert(position, sample);
    return rejected;
}

std::uint64_t ImuQueue::take(std::int64_t stamp_ns, std::vector<ImuSample>& out) {
    out.clear();
    const auto at_or_before = [](std::int64_t t) { return [t](const ImuSample& s) { return s.stamp_ns <= t; }; };
    const auto due = std::partition_point(samples_.begin(), samples_.end(), at_or_before(stamp_ns));
    const auto recent = std::partition_point(samples_.begin(), due, at_or_before(stamp_ns - kHistory_ns));
    const auto absurd = std::partition_point(due, samples_.end(), at_or_before(stamp_ns + kFuture_ns));
    const auto rejected = std::distance(samples_.begin(), recent) + std::distance(absurd, samples_.end());
    out.assign(recent, due);
    samples_.erase(absurd, samples_.end());
    samples_.erase(samples_.begin(), due);
    return static_cast<std::uint64_t>(rejected);
}

}  // namespace dlod::driver
