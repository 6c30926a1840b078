// Any bytes as messages on DLOD_COMMAND: each is ignored and counted, or carried out once and answered, and no name in
// one leads out of the folder of the maps.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "daemon/control/command_decoder.hpp"
#include "daemon/control/command_handler.hpp"
#include "daemon/output/map_store.hpp"
#include "tests/fuzz/input.hpp"

namespace {

using namespace dlod::daemon;

CommandAnswer save_map(const std::string& name) {
    if (name.size() > kLongestArgument) std::abort();
    if (!is_map_name(name)) return {0, false, "no"};
    const std::filesystem::path folder = "/maps";
    if ((folder / (name + ".pcd")).lexically_normal().parent_path() != folder) std::abort();
    return {0, true, name};
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    dlod::fuzz::Input input(data, size);
    std::uint64_t answers = 0;
    CommandHandler handler({.save_map = save_map,
                            .restart_odometry =
                                [] {
                                    return CommandAnswer{0, true, ""};
                                },
                            .set_log_level =
                                [](const std::string&) {
                                    return CommandAnswer{0, true, ""};
                                }},
                           [&](const dlod::command_t& command, const CommandAnswer& answer) {
                               if (answer.id != command.id) std::abort();
                               ++answers;
                           });
    std::uint64_t messages = 0;
    while (!input.empty()) {
        const std::size_t length = input.u8();
        handler.receive(input.bytes(length));
        ++messages;
    }
    std::uint64_t carried_out = 0;
    std::uint64_t ignored = 0;
    handler.visit_counters(
        [&](std::string_view name, std::uint64_t value) { (name == "commands" ? carried_out : ignored) = value; });
    if (answers + ignored != messages || carried_out > answers) std::abort();
    return 0;
}
