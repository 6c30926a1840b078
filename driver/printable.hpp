// What others have said, fit to be repeated.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace dlod::driver {

/// One line for the log, the status and systemd, whatever a sensor has put into its answers: control characters and
/// whatever else is not ASCII become '?', and beyond `longest` characters it is cut off.
inline std::string printable(std::string_view text, std::size_t longest = 100) {
    std::string line(text.substr(0, longest));
    for (char& c : line) {
        if (c < ' ' || c > '~') c = '?';
    }
    if (text.size() > longest) line += "...";
    return line;
}

}  // namespace dlod::driver
