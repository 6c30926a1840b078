#include "daemon/config/config_file.hpp"

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <fstream>
#include <set>
#include <sstream>
#include <utility>
#include <vector>

namespace dlod::daemon {
namespace {

/// Of a file that is no configuration at all, the first ones are enough.
constexpr std::size_t kMostProblems = 20;

[[noreturn]] void fail(const std::string& name, const YAML::Mark& mark, const std::string& message) {
    if (mark.is_null()) throw ConfigError(fmt::format("{}: {}", name, message));
    throw ConfigError(fmt::format("{}:{}: {}", name, mark.line + 1, message));
}

[[noreturn]] void fail_unknown(const OptionList& options, const std::string& place, const std::string& key) {
    throw ConfigError(fmt::format("{}: unknown key '{}'; the nearest known one is '{}' (dlod print-config lists all)",
                                  place, key, nearest_key(options, key)));
}

bool is_group(const OptionList& options, const std::string& prefix) {
    for (const auto& entry : options) {
        const auto* group = std::get_if<OptionGroup>(&entry);
        if (group != nullptr && group->prefix == prefix) return true;
    }
    return false;
}

std::vector<std::string> scalars_of(const YAML::Node& sequence) {
    std::vector<std::string> items;
    for (const auto& item : sequence) {
        if (!item.IsScalar()) throw ConfigError("its items must be single values");
        items.push_back(item.Scalar());
    }
    return items;
}

void assign_node(const Option& option, const YAML::Node& node) {
    if (node.IsSequence()) {
        option.assign_list(scalars_of(node));
    } else if (node.IsScalar()) {
        option.assign(node.Scalar());
    } else {
        throw ConfigError("it has no value");
    }
}

/// Rethrows a complaint about a value with its place, its key and what would be valid.
template <class F>
void with_context(const Option& option, const std::string& place, F&& assign) {
    try {
        assign();
    } catch (const ConfigError& error) {
        const std::string unit = option.unit.empty() ? "" : " [" + option.unit + "]";
        throw ConfigError(
            fmt::format("{}: {}: {}; valid: {}{}", place, option.key, error.what(), option.valid_values(), unit));
    }
}

/// What is wrong with a key does not keep the others from being looked at.
/// @param problems gets a line for each
void apply_map(const OptionList& options, const YAML::Node& map, const std::string& prefix, const std::string& name,
               std::vector<std::string>& problems) {
    if (!map.IsMap())
        fail(name, map.Mark(),
             prefix.empty() ? "not a list of 'key: value'" : fmt::format("{}: expected keys below it", prefix));
    std::set<std::string> seen;
    const auto apply = [&](const auto& entry) {
        if (!entry.first.IsScalar()) fail(name, entry.first.Mark(), "a key must be a word");
        const std::string key = prefix.empty() ? entry.first.Scalar() : prefix + "." + entry.first.Scalar();
        const auto mark = entry.first.Mark();
        if (!seen.insert(key).second) fail(name, mark, fmt::format("{}: given twice", key));
        const std::string place = fmt::format("{}:{}", name, mark.line + 1);
        if (const Option* option = find_option(options, key)) {
            with_context(*option, place, [&] { assign_node(*option, entry.second); });
        } else if (is_group(options, key)) {
            if (!entry.second.IsNull()) apply_map(options, entry.second, key, name, problems);
        } else {
            fail_unknown(options, place, key);
        }
    };
    for (const auto& entry : map) {
        if (problems.size() == kMostProblems) return;
        try {
            apply(entry);
        } catch (const ConfigError& error) {
            problems.emplace_back(error.what());
        }
    }
}

/// Four blanks for each group that the key is in.
std::string indent_of(const std::string& key) {
    return std::string(4 * static_cast<std::size_t>(std::count(key.begin(), key.end(), '.')), ' ');
}

/// Text as comment lines of at most 100 characters.
std::string comment(const std::string& text, const std::string& indent) {
    constexpr std::size_t kWidth = 100;
    std::istringstream words(text);
    std::string out;
    std::string line = indent + "#";
    for (std::string word; words >> word;) {
        if (line.size() + 1 + word.size() > kWidth) {
            out += line + '\n';
            line = indent + "#";
        }
        line += ' ' + word;
    }
    return out + line + '\n';
}

}  // namespace

void apply_yaml(Config& config, const std::string& yaml, const std::string& name) {
    const OptionList options = list_options(config);
    std::vector<std::string> problems;
    try {
        const YAML::Node root = YAML::Load(yaml);
        if (!root.IsNull()) apply_map(options, root, "", name, problems);
    } catch (const YAML::Exception& error) {
        const bool tabs = yaml.find("\n\t") != std::string::npos;
        fail(name, error.mark,
             fmt::format("not valid YAML: {}{}", error.msg, tabs ? "; indent with spaces, not tabs" : ""));
    }
    if (!problems.empty()) throw ConfigError(fmt::format("{}", fmt::join(problems, "\n")));
}

void apply_file(Config& config, const std::filesystem::path& file) {
    std::ifstream stream(file);
    std::ostringstream text;
    if (!stream || std::filesystem::is_directory(file) || !(text << stream.rdbuf())) {
        // An empty file leaves the stream failed although nothing is wrong.
        std::error_code error;
        if (!stream.is_open() || std::filesystem::is_directory(file) || std::filesystem::file_size(file, error) != 0) {
            throw ConfigError(
                fmt::format("{}: cannot be read; check that the file exists and its permissions", file.string()));
        }
    }
    apply_yaml(config, text.str(), file.string());
}

void apply_setting(Config& config, const std::string& setting) {
    const auto equals = setting.find('=');
    if (equals == std::string::npos) throw ConfigError(fmt::format("--set {}: expected key=value", setting));
    const std::string key = setting.substr(0, equals);
    const std::string place = fmt::format("--set {}", setting);
    const OptionList options = list_options(config);
    const Option* option = find_option(options, key);
    if (option == nullptr) fail_unknown(options, place, key);
    with_context(*option, place, [&] {
        if (!option->is_list()) return option->assign(setting.substr(equals + 1));
        try {
            assign_node(*option, YAML::Load(setting.substr(equals + 1)));
        } catch (const YAML::Exception&) {
            throw ConfigError("not a list; write [a, b, ...]");
        }
    });
}

std::string to_yaml(const Config& config) {
    Config values = config;
    Config defaults;
    const OptionList options = list_options(values);
    const OptionList default_options = list_options(defaults);
    std::string out =
        "# Configuration of dlod: every key with its default. A file needs only the keys that differ.\n"
        "# Made by `dlod print-config`; `dlod check-config FILE` checks a file.\n";
    const auto leaf_of = [](const std::string& key) { return key.substr(key.rfind('.') + 1); };
    bool after_nested_group = false;
    for (std::size_t i = 0; i < options.size(); ++i) {
        if (const auto* group = std::get_if<OptionGroup>(&options[i])) {
            const std::string indent = indent_of(group->prefix);
            out += '\n' + comment(group->about, indent) + fmt::format("{}{}:\n", indent, leaf_of(group->prefix));
            after_nested_group = true;
            continue;
        }
        const auto& option = std::get<Option>(options[i]);
        const std::string indent = indent_of(option.key);
        if (indent.empty() && std::exchange(after_nested_group, false)) out += '\n';
        const std::string unit =
            option.unit.empty() || option.unit == "1" ? "" : fmt::format("Unit: {}. ", option.unit);
        out += comment(option.effect + ".", indent);
        out += comment(fmt::format("{}Default: {}. Valid values: {}.", unit,
                                   std::get<Option>(default_options[i]).to_yaml(), option.valid_values()),
                       indent);
        out += fmt::format("{}{}: {}\n", indent, leaf_of(option.key), option.to_yaml());
    }
    return out;
}

}  // namespace dlod::daemon
