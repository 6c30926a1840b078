// Fragments of a few keys in any order, size and time. Each byte tells its key and place: what comes out must have
// every byte from its own key, at its place, whatever else was going on.
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "driver/ip_reassembly.hpp"
#include "tests/fuzz/input.hpp"

namespace {

using namespace dlod::driver;

/// What belongs to key and place; `variant` tells datagrams of the same key apart.
std::byte expected(unsigned key, std::size_t place, unsigned variant) {
    return static_cast<std::byte>((key << 5 | (place / 8 * 7 & 0x0F) << 1) | variant);
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    dlod::fuzz::Input input(data, size);
    IpReassembly reassembly({.datagrams = 4, .fragments = 16, .timeout_fragments = 500});
    std::vector<std::byte> payload;
    std::int64_t time_ns = 0;
    while (!input.empty()) {
        const unsigned key = input.u8() % 8;
        const unsigned flags = input.u8();
        IpPacket fragment;
        fragment.source[15] = static_cast<std::byte>(key & 1U);
        fragment.destination[15] = static_cast<std::byte>(key >> 1U & 1U);
        fragment.id = key >> 2U;
        fragment.protocol = kProtocolUdp;
        fragment.more_fragments = (flags & 1U) != 0;
        fragment.offset = (input.u16() & 0x1FFFU) * 8U;
        if ((flags & 2U) != 0) fragment.offset %= 64;  // close together more often than not
        const std::size_t length = (flags & 4U) != 0 ? input.u16() % 2048U : input.u8() % 8 * 8U;
        const unsigned variant = flags >> 3U & 1U;
        time_ns += static_cast<std::int64_t>(flags >> 4U) * 50'000'000;
        if ((flags & 0xF0U) == 0xF0U) time_ns -= 2'000'000'000;

        payload.resize(length);
        for (std::size_t i = 0; i < length; ++i) payload[i] = expected(key, fragment.offset + i, variant);
        fragment.payload = payload;
        const Bytes whole = reassembly.add(fragment, 0, time_ns);
        for (std::size_t i = 0; i < whole.size(); ++i) {
            if ((whole[i] & std::byte{0xFE}) != expected(key, i, 0)) std::abort();
        }
    }
    reassembly.finish();
    return 0;
}
