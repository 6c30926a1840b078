// Packets of two sensors, each good, patched, cut or made of the input's bytes, into frame builders: nothing may be
// written outside of the frames, and every packet must be accounted for.
#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include "driver/imu.hpp"
#include "tests/driver/synthetic_sensor.hpp"
#include "tests/fuzz/input.hpp"

namespace {

using namespace dlod::driver;
using test::BuilderBench;
using test::SyntheticSensor;

void push_next(dlod::fuzz::Input& input, const SyntheticSensor& sensor, BuilderBench& bench, std::uint32_t& frame_id) {
    const unsigned kind = input.u8();
    frame_id += kind >> 6U;
    bench.port = (kind & 1U) != 0 ? sensor.info().imu_port : sensor.info().lidar_port;
    auto packet = sensor.packet(frame_id, input.u8() % sensor.packets_per_frame());
    if ((kind & 2U) != 0) {
        for (unsigned n = input.u8() % 16U; n > 0; --n) {
            // Headers of packet and columns more often than pixels.
            const std::size_t at = (kind & 4U) != 0 ? input.u16() % packet.size() : input.u8() % packet.size();
            packet[at] = static_cast<std::byte>(input.u8());
        }
    }
    if ((kind & 8U) != 0) packet.resize(input.u16() % (packet.size() + 1));
    if ((kind & 16U) != 0) {
        const auto raw = input.bytes((kind & 32U) != 0 ? kLegacyImuPacketBytes : packet.size());
        packet.assign(raw.begin(), raw.end());
    }
    bench.push(packet);
}

void run(dlod::fuzz::Input& input, const SyntheticSensor& sensor) {
    BuilderBench bench(sensor);
    std::uint32_t frame_id = 65533;
    while (!input.empty()) {
        push_next(input, sensor, bench, frame_id);
        bench.emitted.clear();
    }
    bench.builder.flush();
    if (bench.free_frames.size() != 3) std::abort();
    const FrameBuilderCounters& c = bench.counters();
    std::uint64_t accounted = 0;
    for (const Counter* counter :
         {&c.lidar_packets, &c.imu_packets, &c.duplicate_packets, &c.late_packets, &c.wrong_size_packets,
          &c.wrong_type_packets, &c.foreign_packets, &c.implausible_packets, &c.damaged_packets, &c.dropped_packets,
          &c.imu_unknown_packets, &c.imu_invalid_packets}) {
        accounted += counter->value();
    }
    if (accounted != c.packets.value()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    // Few pixels: what the input decides is in the headers.
    static const SyntheticSensor legacy({.profile = "LEGACY", .rows = 4, .columns = 128});
    static const SyntheticSensor dual(
        {.profile = "RNG19_RFL8_SIG16_NIR16_DUAL", .rows = 4, .columns = 128, .window_first = 96, .window_last = 31});
    dlod::fuzz::Input input(data, size);
    run(input, (input.u8() & 1U) != 0 ? legacy : dual);
    return 0;
}
