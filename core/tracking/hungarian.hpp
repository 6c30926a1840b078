// Optimal assignment (Kuhn's Hungarian method in its shortest-augmenting-path form).
#pragma once

#include <vector>

namespace dlod {

/// Solves rectangular assignment problems; keeps its memory from one call to the next.
class Hungarian {
  public:
    /// Assigns rows to columns one to one, min(rows, columns) pairs, with the least sum of costs.
    /// @param cost rows x columns, row-major, finite
    /// @return the column of each row, -1 where a row has none; equal optima always give the same answer.
    ///         Valid until the next call.
    const std::vector<int>& solve(const std::vector<double>& cost, int rows, int columns);

  private:
    void solve_wide(const std::vector<double>& cost, int rows, int columns);

    std::vector<double> transposed_;
    std::vector<double> row_potential_, column_potential_, distance_;
    std::vector<int> row_of_column_, previous_column_, result_, inverse_;
    std::vector<char> done_;
};

}  // namespace dlod
