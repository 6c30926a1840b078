// An event counter with one writer that any thread may read.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string_view>

namespace dlod::driver {

/// Counts events on one thread; any other may read it at any time. No read-modify-write: it costs what an integer does.
class Counter {
  public:
    Counter() = default;
    Counter(const Counter& other) : value_(other.value()) {}
    Counter& operator=(const Counter& other) {
        value_.store(other.value(), std::memory_order_relaxed);
        return *this;
    }

    void add(std::uint64_t n) { value_.store(value() + n, std::memory_order_relaxed); }
    Counter& operator++() {
        add(1);
        return *this;
    }
    void set(std::uint64_t n) { value_.store(n, std::memory_order_relaxed); }
    std::uint64_t value() const { return value_.load(std::memory_order_relaxed); }

  private:
    std::atomic<std::uint64_t> value_{0};
};

/// Receives each counter of a component under its name (lower case, underscores).
using CounterVisitor = std::function<void(std::string_view name, std::uint64_t value)>;

}  // namespace dlod::driver
