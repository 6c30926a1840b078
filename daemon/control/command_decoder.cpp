#include "daemon/control/command_decoder.hpp"

#include <algorithm>

namespace dlod::daemon {
namespace {

// Fingerprint, utime and id, then the command; behind it the length of the argument, its bytes and a final zero.
constexpr std::size_t kLengthAt = 3 * 8 + 1;
constexpr std::size_t kTextAt = kLengthAt + 4;

std::size_t big_endian_at(std::span<const std::byte> message, std::size_t at) {
    std::size_t value = 0;
    for (std::size_t i = 0; i < 4; ++i) value = value << 8U | std::to_integer<std::size_t>(message[at + i]);
    return value;
}

}  // namespace

std::optional<command_t> decode_command(std::span<const std::byte> message) {
    if (message.size() <= kTextAt || message.size() > kTextAt + kLongestArgument + 1) return std::nullopt;
    if (big_endian_at(message, kLengthAt) != message.size() - kTextAt) return std::nullopt;
    const auto text = message.subspan(kTextAt);
    if (std::find(text.begin(), text.end(), std::byte{0}) != text.end() - 1) return std::nullopt;
    command_t command;
    const auto size = static_cast<int>(message.size());
    if (command.decode(message.data(), 0, size) != size) return std::nullopt;
    return command;
}

}  // namespace dlod::daemon
