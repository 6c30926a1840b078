// The newest of the values that one thread gives, for another thread that looks when it likes. Lock-free: neither
// waits.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>

namespace dlod::daemon {

/// One writer, one reader. Values that were not taken are overwritten.
template <class T>
class LatestValue {
  public:
    /// On the writer's thread.
    void set(const T& value) {
        values_[writing_] = value;
        writing_ = shared_.exchange(static_cast<std::uint8_t>(writing_ | kNew), std::memory_order_acq_rel) & kIndex;
    }
    /// On the reader's thread.
    /// @return the newest value, valid until the next call; nullptr where there is none since the call before
    const T* take() {
        if ((shared_.load(std::memory_order_relaxed) & kNew) == 0) return nullptr;
        reading_ = shared_.exchange(reading_, std::memory_order_acq_rel) & kIndex;
        return &values_[reading_];
    }

  private:
    static constexpr std::uint8_t kIndex = 3, kNew = 4;

    // One is written, one is read, and the third lies between the two.
    std::array<T, 3> values_{};
    std::uint8_t writing_ = 0;
    std::uint8_t reading_ = 1;
    std::atomic<std::uint8_t> shared_{2};
};

}  // namespace dlod::daemon
