#include "core/tracking/hungarian.hpp"

#include <cstddef>
#include <limits>

namespace dlod {

const std::vector<int>& Hungarian::solve(const std::vector<double>& cost, int rows, int columns) {
    if (rows <= columns) {
        solve_wide(cost, rows, columns);
        return result_;
    }
    const auto r = static_cast<std::size_t>(rows);
    const auto c = static_cast<std::size_t>(columns);
    transposed_.resize(r * c);
    for (std::size_t i = 0; i < r; ++i) {
        for (std::size_t j = 0; j < c; ++j) transposed_[j * r + i] = cost[i * c + j];
    }
    solve_wide(transposed_, columns, rows);
    inverse_.assign(r, -1);
    for (std::size_t j = 0; j < c; ++j) inverse_[static_cast<std::size_t>(result_[j])] = static_cast<int>(j);
    result_ = inverse_;
    return result_;
}

// Adds the rows one by one; each finds the cheapest alternating path to a free column under reduced costs
// cost - row potential - column potential, which stay non-negative. Column 0 is a virtual one that holds the new row.
void Hungarian::solve_wide(const std::vector<double>& cost, int rows, int columns) {
    const auto n = static_cast<std::size_t>(rows);
    const auto m = static_cast<std::size_t>(columns);
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    row_potential_.assign(n + 1, 0.0);
    column_potential_.assign(m + 1, 0.0);
    row_of_column_.assign(m + 1, 0);
    previous_column_.assign(m + 1, 0);
    for (std::size_t i = 1; i <= n; ++i) {
        row_of_column_[0] = static_cast<int>(i);
        std::size_t column = 0;
        distance_.assign(m + 1, kInfinity);
        done_.assign(m + 1, 0);
        do {
            done_[column] = 1;
            const auto row = static_cast<std::size_t>(row_of_column_[column]);
            double step = kInfinity;
            std::size_t next = 0;
            for (std::size_t j = 1; j <= m; ++j) {
                if (done_[j]) continue;
                const double reduced = cost[(row - 1) * m + j - 1] - row_potential_[row] - column_potential_[j];
                if (reduced < distance_[j]) {
                    distance_[j] = reduced;
                    previous_column_[j] = static_cast<int>(column);
                }
                if (distance_[j] < step) {
                    step = distance_[j];
                    next = j;
                }
            }
            for (std::size_t j = 0; j <= m; ++j) {
                if (done_[j]) {
                    row_potential_[static_cast<std::size_t>(row_of_column_[j])] += step;
                    column_potential_[j] -= step;
                } else {
                    distance_[j] -= step;
                }
            }
            column = next;
        } while (row_of_column_[column] != 0);
        while (column != 0) {
            const auto previous = static_cast<std::size_t>(previous_column_[column]);
            row_of_column_[column] = row_of_column_[previous];
            column = previous;
        }
    }
    result_.assign(n, -1);
    for (std::size_t j = 1; j <= m; ++j) {
        if (row_of_column_[j] != 0) result_[static_cast<std::size_t>(row_of_column_[j] - 1)] = static_cast<int>(j - 1);
    }
}

}  // namespace dlod
