// Whether a frame's column times can be believed.
#pragma once

#include <cstdint>
#include <vector>

#include "core/types/frame.hpp"

namespace dlod::driver {

/// Finds the course of time that most of a frame's columns agree on, and takes validity from those that do not follow
/// it.
class ColumnClock {
  public:
    /// @param columns         columns a turn
    /// @param turn_ns         time of a turn; a frame that shows another rate is judged by that
    /// @param tolerance_turns how far a column may be off the course, in turns
    ColumnClock(int columns, double turn_ns, double tolerance_turns);

    /// Times of 2^62 ns and more (year 2116) are no times; marked by -1 in Columns::time_ns until reject() has run.
    static std::int64_t to_time(std::uint64_t time_ns) {
        return time_ns < (std::uint64_t{1} << 62U) ? static_cast<std::int64_t>(time_ns) : -1;
    }

    /// Clears `valid` of valid columns, and `time_ns` of all, whose time contradicts the rest. Returns how many valid
    /// ones that were.
    int reject(Columns& columns);

    /// Time at which measurement 0 of the last frame given to reject() was or would have been fired; without meaning
    /// when none of its columns was valid.
    double start_ns() const { return start_ns_; }

  private:
    /// A turn's start that columns agree on, and how many they are.
    struct Course {
        double period_ns;
        double start_ns;
        int support;
    };
    Course agree(const Columns& columns, double period_ns) const;
    int reject_isolated(Columns& columns) const;

    double turn_ns_;
    double period_ns_;
    double tolerance_ns_;
    double start_ns_ = 0.0;
    std::vector<double> error_ns_;  ///< [columns] against the course
    std::vector<int> valid_;        ///< measurements of the valid columns
};

}  // namespace dlod::driver
