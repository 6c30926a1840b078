#pragma once

#include <cstddef>
#include <dlod/command_t.hpp>
#include <optional>
#include <span>

namespace dlod::daemon {

/// Longest argument of a command, bytes.
inline constexpr std::size_t kLongestArgument = 200;

/// The command that a message on DLOD_COMMAND holds; nothing where the bytes are not exactly one: of another type, cut
/// short, with something behind it, or with an argument that is too long or no text. LCM's own decoder trusts the
/// length of a text that the sender wrote; this checks it first.
std::optional<command_t> decode_command(std::span<const std::byte> message);

}  // namespace dlod::daemon
