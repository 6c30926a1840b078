#include "tools/eval/assignment.hpp"

#include <limits>

namespace dlod::tools {

std::vector<int> assign(const Eigen::MatrixXd& cost) {
    if (cost.rows() > cost.cols()) {
        std::vector<int> row_of(assign(cost.transpose()));
        std::vector<int> column_of(static_cast<std::size_t>(cost.rows()), -1);
        for (std::size_t c = 0; c < row_of.size(); ++c)
            column_of[static_cast<std::size_t>(row_of[c])] = static_cast<int>(c);
        return column_of;
    }
    const auto n = static_cast<std::size_t>(cost.rows());
    const auto m = static_cast<std::size_t>(cost.cols());
    // Potentials of rows and columns, 1-based; row_at[0] is the row being placed.
    std::vector<double> u(n + 1, 0.0), v(m + 1, 0.0);
    std::vector<std::size_t> row_at(m + 1, 0), from(m + 1, 0);
    for (std::size_t row = 1; row <= n; ++row) {
        row_at[0] = row;
        std::size_t column = 0;
        std::vector<double> slack(m + 1, std::numeric_limits<double>::infinity());
        std::vector<bool> reached(m + 1, false);
        while (row_at[column] != 0) {
            reached[column] = true;
            const std::size_t r = row_at[column];
            double least = std::numeric_limits<double>::infinity();
            std::size_t next = 0;
            for (std::size_t c = 1; c <= m; ++c) {
                if (reached[c]) continue;
                const double reduced =
                    cost(static_cast<Eigen::Index>(r - 1), static_cast<Eigen::Index>(c - 1)) - u[r] - v[c];
                if (reduced < slack[c]) {
                    slack[c] = reduced;
                    from[c] = column;
                }
                if (slack[c] < least) {
                    least = slack[c];
                    next = c;
                }
            }
            for (std::size_t c = 0; c <= m; ++c) {
                if (reached[c]) {
                    u[row_at[c]] += least;
                    v[c] -= least;
                } else {
                    slack[c] -= least;
                }
            }
            column = next;
        }
        for (; column != 0; column = from[column]) row_at[column] = row_at[from[column]];
    }
    std::vector<int> column_of(n, -1);
    for (std::size_t c = 1; c <= m; ++c) {
        if (row_at[c] != 0) column_of[row_at[c] - 1] = static_cast<int>(c - 1);
    }
    return column_of;
}

}  // namespace dlod::tools
