#include "driver/column_clock.hpp"

#include <algorithm>
#include <cmath>

namespace dlod::driver {
namespace {

/// A column further from where its neighbours agree, in turns, is damaged: motors turn far more steadily.
constexpr double kIsolated_turns = 0.002;

}  // namespace

ColumnClock::ColumnClock(int columns, double turn_ns, double tolerance_turns)
    : turn_ns_(turn_ns),
      period_ns_(turn_ns / columns),
      tolerance_ns_(tolerance_turns * turn_ns),
      error_ns_(static_cast<std::size_t>(columns)) {
    valid_.reserve(static_cast<std::size_t>(columns));
}

ColumnClock::Course ColumnClock::agree(const Columns& columns, double period_ns) const {
    const auto start_of = [&](int m) {
        return static_cast<double>(columns.time_ns[static_cast<std::size_t>(m)]) - m * period_ns;
    };
    // Majority vote after Boyer and Moore, with a tolerance.
    Course course{period_ns, 0.0, 0};
    int votes = 0;
    for (const int m : valid_) {
        if (votes == 0) course.start_ns = start_of(m);
        votes += std::abs(start_of(m) - course.start_ns) <= tolerance_ns_ ? 1 : -1;
    }
    for (const int m : valid_) course.support += std::abs(start_of(m) - course.start_ns) <= tolerance_ns_ ? 1 : 0;
    return course;
}

int ColumnClock::reject(Columns& columns) {
    valid_.clear();
    for (std::size_t m = 0; m < error_ns_.size(); ++m) {
        if (columns.valid[m] != 0) valid_.push_back(static_cast<int>(m));
    }
    if (valid_.empty()) {
        std::replace(columns.time_ns.begin(), columns.time_ns.end(), std::int64_t{-1}, std::int64_t{0});
        return 0;
    }
    Course course = agree(columns, period_ns_);
    if (2 * course.support < static_cast<int>(valid_.size())) {
        const auto time_of = [&](int m) { return static_cast<double>(columns.time_ns[static_cast<std::size_t>(m)]); };
        const double shown_ns = (time_of(valid_.back()) - time_of(valid_.front())) / (valid_.back() - valid_.front());
        const Course shown = agree(columns, shown_ns);
        if (shown_ns > 0.0 && shown.support > course.support) course = shown;
    }
    start_ns_ = course.start_ns;

    valid_.clear();
    int rejected = 0;
    for (std::size_t m = 0; m < error_ns_.size(); ++m) {
        if (columns.time_ns[m] == 0 && columns.valid[m] == 0) continue;
        error_ns_[m] = static_cast<double>(columns.time_ns[m]) - static_cast<double>(m) * course.period_ns - start_ns_;
        if (columns.time_ns[m] < 0 || std::abs(error_ns_[m]) > tolerance_ns_) {
            rejected += columns.valid[m];
            columns.valid[m] = 0;
            columns.time_ns[m] = 0;
        } else if (columns.valid[m] != 0) {
            valid_.push_back(static_cast<int>(m));
        }
    }
    return rejected + reject_isolated(columns);
}

int ColumnClock::reject_isolated(Columns& columns) const {
    // Like a median of three: where the two nearest columns agree with each other but not with this one, it is wrong.
    const std::size_t count = valid_.size();
    if (count < 3) return 0;
    const double tolerance_ns = kIsolated_turns * turn_ns_;
    const auto error = [&](std::size_t k) { return error_ns_[static_cast<std::size_t>(valid_[k])]; };
    int rejected = 0;
    for (std::size_t k = 0; k < count; ++k) {
        const std::size_t centre = std::clamp<std::size_t>(k, 1, count - 2);
        const double one = error(k == centre - 1 ? centre : centre - 1);
        const double other = error(k == centre + 1 ? centre : centre + 1);
        const bool neighbours_agree = std::abs(one - other) <= tolerance_ns;
        const bool agrees = std::abs(error(k) - one) <= tolerance_ns || std::abs(error(k) - other) <= tolerance_ns;
        if (!neighbours_agree || agrees) continue;
        ++rejected;
        columns.valid[static_cast<std::size_t>(valid_[k])] = 0;
        columns.time_ns[static_cast<std::size_t>(valid_[k])] = 0;
    }
    return rejected;
}

}  // namespace dlod::driver
