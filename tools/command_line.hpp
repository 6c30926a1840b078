// What the tools' command lines have in common.
#pragma once

#include <CLI/CLI.hpp>
#include <optional>

namespace dlod::tools {

/// Fills the options of `app`. @return the exit code where the program has nothing more to do: 0 after --help, 2, as
/// dlod's, where the command line is wrong, which has been said
inline std::optional<int> parse_command_line(CLI::App& app, int argc, const char* const* argv) {
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : 2;
    }
    return std::nullopt;
}

}  // namespace dlod::tools
