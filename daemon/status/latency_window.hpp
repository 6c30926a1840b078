#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace dlod::daemon {

/// The last values of a series, and their percentiles.
class LatencyWindow {
  public:
    static constexpr std::size_t kLength = 128;

    struct Percentiles {
        float p50 = 0.0F;
        float p99 = 0.0F;
        float max = 0.0F;
    };

    void add(float value) {
        values_[next_] = value;
        next_ = (next_ + 1) % kLength;
        size_ = std::min(size_ + 1, kLength);
    }
    /// Zeros where nothing was added. The value at rank ceil(p n).
    Percentiles percentiles() const {
        if (size_ == 0) return {};
        auto sorted = values_;
        std::sort(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(size_));
        return {sorted[(size_ + 1) / 2 - 1], sorted[(99 * size_ + 99) / 100 - 1], sorted[size_ - 1]};
    }

  private:
    std::array<float, kLength> values_{};
    std::size_t next_ = 0;
    std::size_t size_ = 0;
};

}  // namespace dlod::daemon
