#include "daemon/config/option.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <numeric>
#include <optional>
#include <utility>

#include "daemon/config/config.hpp"

namespace dlod::daemon {
namespace {

/// The visitor of core/types/parameter.hpp, with text and lists added, that collects options.
class OptionCollector {
  public:
    OptionList list;

    void parameter(const char* key, int& member, Range range, const char* unit, const char* effect) {
        add({path(key), &member, range, unit, {}, effect});
    }
    void parameter(const char* key, double& member, Range range, const char* unit, const char* effect) {
        add({path(key), &member, range, unit, {}, effect});
    }
    void flag(const char* key, bool& member, const char* effect) { add({path(key), &member, {}, {}, {}, effect}); }
    void choice(const char* key, int& member, std::vector<std::string> names, const char* effect) {
        add({path(key), &member, {}, {}, std::move(names), effect});
    }
    void text(const char* key, std::string& member, const char* effect) {
        add({path(key), &member, {}, {}, {}, effect});
    }
    template <std::size_t N>
    void vector(const char* key, std::array<double, N>& member, Range range, const char* unit, const char* effect) {
        add({path(key), std::span<double>(member), range, unit, {}, effect});
    }
    void list_of(const char* key, std::vector<double>& member, Range range, const char* unit, const char* effect) {
        add({path(key), &member, range, unit, {}, effect});
    }
    template <class G>
    void group(const char* key, G& member, const char* about) {
        const std::string outer = std::exchange(prefix_, path(key));
        list.emplace_back(OptionGroup{prefix_, about});
        member.visit(*this);
        prefix_ = outer;
    }

  private:
    std::string path(const char* key) const { return prefix_.empty() ? key : prefix_ + "." + key; }
    void add(Option option) { list.emplace_back(std::move(option)); }

    std::string prefix_;
};

template <class T>
std::optional<T> parse_number(std::string_view text) {
    T value{};
    if (text.starts_with('+')) text.remove_prefix(1);
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
    return value;
}

void check_range(double value, const Range& range) {
    if (!(value >= range.low && value <= range.high)) throw ConfigError(fmt::format("{} is out of range", value));
}

double parse_real(std::string_view text, const Range& range) {
    const auto value = parse_number<double>(text);
    if (!value || !std::isfinite(*value)) throw ConfigError(fmt::format("'{}' is not a number", text));
    check_range(*value, range);
    return *value;
}

bool parse_flag(std::string_view text) {
    for (const char* yes : {"true", "on", "yes"}) {
        if (text == yes) return true;
    }
    for (const char* no : {"false", "off", "no"}) {
        if (text == no) return false;
    }
    throw ConfigError(fmt::format("'{}' is neither true nor false", text));
}

std::string real_to_yaml(double value) {
    return fmt::format("{}", value);
}

template <class Range_>
std::string reals_to_yaml(const Range_& values) {
    std::vector<std::string> items;
    for (const double value : values) items.push_back(real_to_yaml(value));
    return fmt::format("[{}]", fmt::join(items, ", "));
}

std::string yaml_quoted(const std::string& text) {
    std::string out = "\"";
    for (const char c : text) {
        if (c == '"' || c == '\\') out += '\\';
        out += c;
    }
    return out + '"';
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
    std::vector<std::size_t> row(b.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 1; i <= a.size(); ++i) {
        std::size_t diagonal = std::exchange(row[0], i);
        for (std::size_t j = 1; j <= b.size(); ++j) {
            const std::size_t substituted = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
            diagonal = row[j];
            row[j] = std::min({row[j] + 1, row[j - 1] + 1, substituted});
        }
    }
    return row.back();
}

}  // namespace

void Option::assign(std::string_view text) const {
    if (is_list()) throw ConfigError(fmt::format("'{}' is not a list; write [a, b, ...]", text));
    if (!choices.empty()) {
        const auto found = std::find(choices.begin(), choices.end(), text);
        if (found == choices.end()) throw ConfigError(fmt::format("'{}' is not one of the choices", text));
        *std::get<int*>(value) = static_cast<int>(found - choices.begin());
    } else if (auto* const* integer = std::get_if<int*>(&value)) {
        const auto parsed = parse_number<int>(text);
        if (!parsed) throw ConfigError(fmt::format("'{}' is not a whole number", text));
        check_range(*parsed, range);
        **integer = *parsed;
    } else if (auto* const* real = std::get_if<double*>(&value)) {
        **real = parse_real(text, range);
    } else if (auto* const* flag = std::get_if<bool*>(&value)) {
        **flag = parse_flag(text);
    } else {
        *std::get<std::string*>(value) = std::string(text);
    }
}

void Option::assign_list(const std::vector<std::string>& items) const {
    std::vector<double> values;
    for (const auto& item : items) values.push_back(parse_real(item, range));
    if (const auto* fixed = std::get_if<std::span<double>>(&value)) {
        if (values.size() != fixed->size()) {
            throw ConfigError(fmt::format("it has {} values instead of {}", values.size(), fixed->size()));
        }
        std::copy(values.begin(), values.end(), fixed->begin());
    } else if (auto* const* list = std::get_if<std::vector<double>*>(&value)) {
        **list = values;
    } else {
        throw ConfigError("it takes one value, not a list");
    }
}

bool Option::is_list() const {
    return std::holds_alternative<std::span<double>>(value) || std::holds_alternative<std::vector<double>*>(value);
}

std::string Option::to_yaml() const {
    if (!choices.empty()) return choices[static_cast<std::size_t>(*std::get<int*>(value))];
    if (auto* const* integer = std::get_if<int*>(&value)) return fmt::format("{}", **integer);
    if (auto* const* real = std::get_if<double*>(&value)) return real_to_yaml(**real);
    if (auto* const* flag = std::get_if<bool*>(&value)) return **flag ? "true" : "false";
    if (const auto* fixed = std::get_if<std::span<double>>(&value)) return reals_to_yaml(*fixed);
    if (auto* const* list = std::get_if<std::vector<double>*>(&value)) return reals_to_yaml(**list);
    return yaml_quoted(*std::get<std::string*>(value));
}

std::string Option::valid_values() const {
    if (!choices.empty()) return fmt::format("{}", fmt::join(choices, ", "));
    if (std::holds_alternative<bool*>(value)) return "true, false";
    if (std::holds_alternative<std::string*>(value)) return "text";
    const std::string bounds = fmt::format("{} to {}", range.low, range.high);
    if (const auto* fixed = std::get_if<std::span<double>>(&value)) {
        return fmt::format("{} numbers, each {}", fixed->size(), bounds);
    }
    return is_list() ? fmt::format("a list of numbers, each {}", bounds) : bounds;
}

OptionList list_options(Config& config) {
    OptionCollector collector;
    config.visit(collector);
    return std::move(collector.list);
}

const Option* find_option(const OptionList& options, std::string_view key) {
    for (const auto& entry : options) {
        const auto* option = std::get_if<Option>(&entry);
        if (option != nullptr && option->key == key) return option;
    }
    return nullptr;
}

std::string nearest_key(const OptionList& options, std::string_view key) {
    const std::string_view leaf = key.substr(key.rfind('.') + 1);
    std::string best;
    std::size_t best_distance = static_cast<std::size_t>(-1);
    for (const auto& entry : options) {
        const auto* option = std::get_if<Option>(&entry);
        // A right name in the wrong group is nearer than a wrong name in the right one.
        const std::string_view known = option != nullptr ? option->key : std::get<OptionGroup>(entry).prefix;
        const std::size_t distance =
            std::min(edit_distance(known, key), 1 + edit_distance(known.substr(known.rfind('.') + 1), leaf));
        if (distance < best_distance) {
            best_distance = distance;
            best = known;
        }
    }
    return best;
}

}  // namespace dlod::daemon
