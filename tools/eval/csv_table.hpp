// A CSV file with a header line, held in memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace dlod::tools {

/// No quoting, no spaces: as all CSV files of a run and of a truth folder are.
class CsvTable {
  public:
    /// Throws std::runtime_error naming the file, and the line where one is of the wrong length.
    explicit CsvTable(const std::filesystem::path& path);

    std::size_t rows() const { return rows_; }
    bool has(std::string_view name) const;
    const std::vector<std::string>& names() const { return names_; }

    /// Index of the named column; throws std::runtime_error naming file and column when it is not there.
    std::size_t column(std::string_view name) const;

    std::string_view text(std::size_t row, std::size_t column) const { return cells_[row * names_.size() + column]; }
    /// Throw std::runtime_error naming file, line and column when the cell is no number.
    double number(std::size_t row, std::size_t column) const;
    std::int64_t integer(std::size_t row, std::size_t column) const;

  private:
    template <class T>
    T parse(std::size_t row, std::size_t column) const;

    std::string file_;
    std::string content_;  ///< the cells point into it
    std::vector<std::string> names_;
    std::vector<std::string_view> cells_;
    std::size_t rows_ = 0;
};

/// Content of a whole file; throws std::runtime_error naming it when it cannot be read.
std::string read_file(const std::filesystem::path& path);

}  // namespace dlod::tools
