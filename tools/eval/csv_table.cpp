#include "tools/eval/csv_table.hpp"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <sstream>
#include <stdexcept>

namespace dlod::tools {
namespace {

void split(std::string_view line, std::vector<std::string_view>& cells) {
    cells.clear();
    for (std::size_t begin = 0; begin <= line.size();) {
        const std::size_t end = std::min(line.find(',', begin), line.size());
        cells.push_back(line.substr(begin, end - begin));
        begin = end + 1;
    }
}

}  // namespace

std::string read_file(const std::filesystem::path& path) {
    std::ifstream in(path, std::ios::binary);
    std::ostringstream content;
    if (in) content << in.rdbuf();
    if (!in) throw std::runtime_error(path.string() + ": cannot be read");
    return std::move(content).str();
}

CsvTable::CsvTable(const std::filesystem::path& path) : file_(path.string()), content_(read_file(path)) {
    std::string_view rest = content_;
    std::vector<std::string_view> cells;
    for (std::size_t line_number = 1; !rest.empty(); ++line_number) {
        const std::size_t end = std::min(rest.find('\n'), rest.size());
        std::string_view line = rest.substr(0, end);
        rest.remove_prefix(std::min(end + 1, rest.size()));
        if (line.ends_with('\r')) line.remove_suffix(1);
        if (line.empty()) continue;
        split(line, cells);
        if (names_.empty()) {
            names_.assign(cells.begin(), cells.end());
            continue;
        }
        if (cells.size() != names_.size()) {
            throw std::runtime_error(file_ + ":" + std::to_string(line_number) + ": " + std::to_string(cells.size()) +
                                     " cells, the header has " + std::to_string(names_.size()));
        }
        cells_.insert(cells_.end(), cells.begin(), cells.end());
        ++rows_;
    }
    if (names_.empty()) throw std::runtime_error(file_ + ": no header line");
}

bool CsvTable::has(std::string_view name) const {
    return std::find(names_.begin(), names_.end(), name) != names_.end();
}

std::size_t CsvTable::column(std::string_view name) const {
    const auto found = std::find(names_.begin(), names_.end(), name);
    if (found == names_.end()) throw std::runtime_error(file_ + ": no column " + std::string(name));
    return static_cast<std::size_t>(found - names_.begin());
}

template <class T>
T CsvTable::parse(std::size_t row, std::size_t column) const {
    const std::string_view cell = text(row, column);
    T value{};
    const auto [end, error] = std::from_chars(cell.data(), cell.data() + cell.size(), value);
    if (error != std::errc{} || end != cell.data() + cell.size()) {
        throw std::runtime_error(file_ + ": row " + std::to_string(row + 1) + ", " + names_[column] +
                                 ": not a number: " + std::string(cell));
    }
    return value;
}

double CsvTable::number(std::size_t row, std::size_t column) const {
    return parse<double>(row, column);
}
std::int64_t CsvTable::integer(std::size_t row, std::size_t column) const {
    return parse<std::int64_t>(row, column);
}

}  // namespace dlod::tools
