// The configuration as a flat list of named values, for everything that treats all keys alike.
#pragma once

#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/types/parameter.hpp"

namespace dlod::daemon {

struct Config;

/// What is wrong with a configuration: the message names file, line and key, and what would be right.
class ConfigError : public std::runtime_error {
  public:
    using std::runtime_error::runtime_error;
};

/// One key of a Config. It points into that Config, which must outlive it.
class Option {
  public:
    using Value = std::variant<int*, double*, bool*, std::string*, std::span<double>, std::vector<double>*>;

    std::string key;  ///< full, "tracking.alpha"
    Value value;
    Range range;                       ///< of numbers
    std::string unit;                  ///< of numbers
    std::vector<std::string> choices;  ///< of an int that is an index into them
    std::string effect;

    /// Takes one scalar as written in YAML or on the command line. Lists: use assign_list.
    /// @throws ConfigError with a message about the value alone; the caller adds key and place
    void assign(std::string_view text) const;
    /// @throws ConfigError likewise
    void assign_list(const std::vector<std::string>& items) const;
    bool is_list() const;
    /// The value as YAML.
    std::string to_yaml() const;
    /// "Valid values", in words.
    std::string valid_values() const;
};

/// A heading: the keys that start with `prefix` + '.' follow it.
struct OptionGroup {
    std::string prefix;  ///< "tracking"
    std::string about;
};

/// All keys in their order of declaration, groups in between where they begin.
using OptionList = std::vector<std::variant<OptionGroup, Option>>;
OptionList list_options(Config& config);

/// The option of that key, or nullptr.
const Option* find_option(const OptionList& options, std::string_view key);
/// The known key most like `key`.
std::string nearest_key(const OptionList& options, std::string_view key);

}  // namespace dlod::daemon
