// Any bytes as a capture file: link layers, IP, fragments and UDP as they come. It must come to its end, and no
// datagram may reach beyond its packet (AddressSanitizer watches the bytes that are read).
#include <sys/mman.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <string>

#include "driver/pcap_source.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    using namespace dlod::driver;
    static const int file = ::memfd_create("capture", 0);
    static const std::string path = "/proc/self/fd/" + std::to_string(file);
    if (::ftruncate(file, 0) != 0 || ::pwrite(file, data, size, 0) != static_cast<ssize_t>(size)) std::abort();
    try {
        PcapSource source(path);
        unsigned sum = 0;
        for (PacketBatch batch = source.next(); batch.status == SourceStatus::kPackets; batch = source.next()) {
            for (const Packet& packet : batch.packets) {
                for (const std::byte b : packet.data) sum += std::to_integer<unsigned>(b);
            }
        }
        [[maybe_unused]] volatile unsigned keep = sum;
        const PcapCounters& c = source.counters();
        const auto handled = c.delivered.value() + c.other_port.value() + c.not_ip.value() + c.not_udp.value() +
                             c.cut_short.value() + c.malformed.value() + c.checksum_wrong.value();
        if (handled > c.records.value()) std::abort();
    } catch (const SourceError&) {
        return 0;
    }
    return 0;
}
