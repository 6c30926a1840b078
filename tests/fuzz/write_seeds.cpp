// Writes a few small inputs for each fuzzer: write_seeds FOLDER makes FOLDER/capture, FOLDER/metadata, ...
#include <cstdio>
#include <dlod/command_t.hpp>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "daemon/config/config.hpp"
#include "daemon/config/config_file.hpp"
#include "tests/driver/synthetic_sensor.hpp"
#include "tests/support/network_bytes.hpp"

namespace {

using namespace dlod;
using test::ByteVector;

void write(const std::filesystem::path& folder, const std::string& name, const void* data, std::size_t size) {
    std::filesystem::create_directories(folder);
    std::ofstream out(folder / name, std::ios::binary);
    out.write(static_cast<const char*>(data), static_cast<std::streamsize>(size));
}

void write_captures(const std::filesystem::path& folder) {
    for (const int link : {0, 1, 101, 108, 113, 276}) {
        for (const auto kind : {test::FileKind::kNanosecond, test::FileKind::kPcapng}) {
            std::vector<test::Record> records;
            std::int64_t time_ns = 1'700'000'000'000'000'000;
            for (const bool ipv6 : {false, true}) {
                const ByteVector datagram = test::udp(test::payload_pattern(100, 1), {.ipv6 = ipv6});
                std::vector<ByteVector> packets = test::ip_fragments(datagram, {.ipv6 = ipv6}, 56);
                packets.push_back(test::ip(datagram, {.ipv6 = ipv6}));
                for (const ByteVector& p : packets) {
                    const std::vector<unsigned> vlans = ipv6 ? std::vector<unsigned>{} : std::vector<unsigned>{5};
                    records.push_back({time_ns += 1000, test::link_frame(link, p, vlans)});
                }
            }
            const ByteVector file = test::capture_file(kind, static_cast<std::uint32_t>(link), records);
            write(folder, std::to_string(link) + "_" + std::to_string(static_cast<int>(kind)), file.data(),
                  file.size());
        }
    }
}

void write_metadata(const std::filesystem::path& folder) {
    for (const char* profile : {"LEGACY", "RNG15_RFL8_NIR8", "FUSA_RNG15_RFL8_NIR8_DUAL"}) {
        const std::string json = driver::test::synthetic_metadata({.profile = profile});
        write(folder, profile, json.data(), json.size());
    }
}

void write_operations(const std::filesystem::path& folder, std::size_t size) {
    for (std::uint32_t i = 0; i < 4; ++i) {
        const ByteVector bytes = test::payload_pattern(size, i);
        write(folder, std::to_string(i), bytes.data(), bytes.size());
    }
}

/// Commands as the fuzzer reads them: length, then bytes.
void write_commands(const std::filesystem::path& folder) {
    for (const char* argument : {"", "hall", "../escaped", "debug"}) {
        std::string input;
        for (const std::int8_t number : {command_t::SAVE_MAP, command_t::RESTART_ODOMETRY, command_t::SET_LOG_LEVEL}) {
            command_t command{};
            command.utime = 1'700'000'000'000'000;
            command.id = number;
            command.command = number;
            command.argument = argument;
            std::string bytes(static_cast<std::size_t>(command.getEncodedSize()), '\0');
            command.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
            input += static_cast<char>(bytes.size()) + bytes;
        }
        write(folder,
              *argument == '.'    ? "escaped"
              : *argument == '\0' ? "empty"
                                  : argument,
              input.data(), input.size());
    }
}

/// Every key, a file a group, without the comments: whole files are read too slowly to try many.
void write_configurations(const std::filesystem::path& folder) {
    std::istringstream all(daemon::to_yaml({}));
    std::string group;
    int groups = 0;
    const auto write_group = [&] {
        if (!group.empty()) write(folder, "group" + std::to_string(groups++), group.data(), group.size());
        group.clear();
    };
    for (std::string line; std::getline(all, line);) {
        if (line.empty() || line[line.find_first_not_of(' ')] == '#') continue;
        if (line[0] != ' ') write_group();
        group += line + '\n';
    }
    write_group();
    for (const std::string text : {"sensor: {metadata: a.json, lidar_port: 7502}\nlcm: {url: none}\n",
                                   "robot_body:\n  boxes_m: [0, 0, 0, 1, 1, 1]\npipeline: {pin_to_cpus: [0, 1]}\n",
                                   "extrinsics: &a {rotation_wxyz: [1, 0, 0, 0]}\nodometry: {use_imu: off}\n"}) {
        write(folder, std::to_string(text.size()), text.data(), text.size());
    }
}

}  // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        std::fprintf(stderr, "usage: write_seeds FOLDER\n");
        return 2;
    }
    const std::filesystem::path folder = argv[1];
    write_captures(folder / "capture");
    write_metadata(folder / "metadata");
    write_commands(folder / "command");
    write_configurations(folder / "config");
    write_operations(folder / "reassembly", 120);
    write_operations(folder / "packets", 400);
    return 0;
}
