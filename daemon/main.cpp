// Command line of dlod.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <csignal>
#include <cstdio>
#include <dlod/command_t.hpp>
#include <exception>
#include <map>

#include "daemon/commands/commands.hpp"
#include "daemon/config/option.hpp"
#include "daemon/output/output_file.hpp"
#include "daemon/pipeline/huge_pages.hpp"
#include "daemon/publish/lcm_bus.hpp"
#include "driver/metadata.hpp"
#include "driver/packet_source.hpp"

namespace {

using dlod::daemon::ExitCode;

constexpr const char* kExitCodes =
    "Exit codes: 0 success (replay: the capture's end was reached), 1 failure, 2 command line, 3 configuration or "
    "metadata, 4 capture or socket, 5 output, 6 LCM, 7 interrupted replay.";

/// Options that stand for one setting each, in the order given.
void add_setting(CLI::App& command, const std::string& flag, const std::string& key, std::vector<std::string>& settings,
                 const std::string& help) {
    command.add_option_function<std::string>(
        flag, [key, &settings](const std::string& value) { settings.push_back(key + "=" + value); }, help);
}

void add_config_options(CLI::App& command, dlod::daemon::ConfigSources& config) {
    command.add_option("-c,--config", config.file,
                       "configuration file (YAML); keys that it does not name keep their defaults");
    command
        .add_option_function<std::vector<std::string>>(
            "--set",
            [&config](const std::vector<std::string>& values) {
                config.settings.insert(config.settings.end(), values.begin(), values.end());
            },
            "a single setting, key=value; may be repeated")
        ->allow_extra_args(false);
}

int fail(ExitCode code, const std::exception& error) {
    std::fprintf(stderr, "dlod: %s\n", error.what());
    return static_cast<int>(code);
}

}  // namespace

int main(int argc, char** argv) {
    using namespace dlod::daemon;
    prefer_huge_pages();
    std::signal(SIGXFSZ, SIG_IGN);  // a limit on the size of files is an error of the file, not the end
    CLI::App app("Dynamic LiDAR odometry: pose, moving points and tracks from an Ouster lidar, over LCM.", "dlod");
    app.set_version_flag("--version", "dlod " DLOD_VERSION);
    app.require_subcommand(1);
    app.footer(kExitCodes);

    RunArguments run_arguments;
    auto* run_command = app.add_subcommand("run", "process a live sensor's packets until SIGINT or SIGTERM");
    add_config_options(*run_command, run_arguments.config);
    add_setting(*run_command, "--metadata", "sensor.metadata", run_arguments.config.settings, "sensor metadata (JSON)");
    add_setting(*run_command, "--threads", "pipeline.threads", run_arguments.config.settings,
                "threads that run the stages");
    add_setting(*run_command, "--out", "output.folder", run_arguments.config.settings, "folder for result files");
    add_setting(*run_command, "--lcm", "lcm.url", run_arguments.config.settings, "LCM provider, or none");

    ReplayArguments replay_arguments;
    auto* replay_command = app.add_subcommand("replay", "process a capture (pcap, pcapng)");
    replay_command->add_option("PCAP", replay_arguments.capture, "capture file")->required();
    replay_command->add_option("--metadata", replay_arguments.metadata,
                               "sensor metadata (JSON); default: PCAP's name with .json");
    add_config_options(*replay_command, replay_arguments.config);
    add_setting(*replay_command, "--threads", "pipeline.threads", replay_arguments.config.settings,
                "threads that run the stages");
    add_setting(*replay_command, "--out", "output.folder", replay_arguments.config.settings, "folder for result files");
    add_setting(*replay_command, "--lcm", "lcm.url", replay_arguments.config.settings, "LCM provider; default: none");
    replay_command
        ->add_option("--rate", replay_arguments.rate,
                     "0: as fast as possible (default), 1: true rate, 2: twice as fast, ...")
        ->check(CLI::Range(0.0, 1000.0));

    SendArguments send_arguments;
    auto* send_command_line =
        app.add_subcommand("command", "tell a running dlod to do something, and print its answer");
    const std::map<std::string, int> commands = {{"save-map", dlod::command_t::SAVE_MAP},
                                                 {"restart-odometry", dlod::command_t::RESTART_ODOMETRY},
                                                 {"log-level", dlod::command_t::SET_LOG_LEVEL}};
    std::string command_name;
    send_command_line
        ->add_option("COMMAND", command_name,
                     "save-map [NAME]: NAME.pcd and NAME.ply in saved_maps.folder, by default named by the time; "
                     "restart-odometry: pose, map and tracks begin anew; log-level LEVEL: trace, debug, info, warning, "
                     "error or off")
        ->required()
        ->check(CLI::IsMember(&commands));
    send_command_line->add_option("ARGUMENT", send_arguments.argument, "of the command");
    send_command_line->add_option("--timeout", send_arguments.timeout_s, "seconds to wait for the answer; default: 15")
        ->check(CLI::Range(0.1, 3600.0));
    add_config_options(*send_command_line, send_arguments.config);
    add_setting(*send_command_line, "--lcm", "lcm.url", send_arguments.config.settings, "LCM provider");

    ConfigSources doctored;
    auto* doctor_command = app.add_subcommand("doctor", "check this machine and say how to mend what is wrong");
    add_config_options(*doctor_command, doctored);

    std::filesystem::path info_file;
    std::optional<std::filesystem::path> info_metadata;
    auto* info_command = app.add_subcommand("info", "describe a capture or a metadata file");
    info_command->add_option("FILE", info_file, "capture, or sensor metadata ending in .json")->required();
    info_command->add_option("--metadata", info_metadata, "metadata of the capture; default: its name with .json");

    ConfigSources checked;
    std::optional<std::filesystem::path> checked_metadata;
    auto* check_command = app.add_subcommand("check-config", "check a configuration file");
    check_command->add_option("FILE", checked.file, "configuration file")->required();
    check_command->add_option("--metadata", checked_metadata, "check it on top of this sensor's preset");

    ConfigSources printed;
    std::optional<std::filesystem::path> printed_metadata;
    auto* print_command =
        app.add_subcommand("print-config", "print every key with its meaning and its value in effect");
    add_config_options(*print_command, printed);
    print_command->add_option("--metadata", printed_metadata, "with this sensor's preset");

    for (auto* command : app.get_subcommands({})) command->footer(kExitCodes);
    const auto known = app.get_subcommands({});
    if (argc > 1 && argv[1][0] != '-' && std::none_of(known.begin(), known.end(), [&](const CLI::App* command) {
            return command->check_name(argv[1]);
        })) {
        std::fprintf(stderr, "dlod: there is no command '%s'; dlod --help lists them\n", argv[1]);
        return static_cast<int>(ExitCode::kUsage);
    }
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : static_cast<int>(ExitCode::kUsage);
    }
    try {
        ExitCode code = ExitCode::kSuccess;
        if (*run_command) code = run(run_arguments);
        if (*replay_command) code = replay(replay_arguments);
        if (*send_command_line) {
            send_arguments.command = commands.at(command_name);
            code = send_command(send_arguments);
        }
        if (*doctor_command) code = doctor(doctored);
        if (*info_command) code = info(info_file, info_metadata);
        if (*check_command) code = check_config(checked, checked_metadata);
        if (*print_command) code = print_config(printed, printed_metadata);
        if (std::fflush(stdout) != 0 || std::ferror(stdout) != 0)
            throw OutputError("standard output cannot be written");
        return static_cast<int>(code);
    } catch (const ConfigError& error) {
        return fail(ExitCode::kConfiguration, error);
    } catch (const dlod::driver::MetadataError& error) {
        return fail(ExitCode::kConfiguration, error);
    } catch (const dlod::driver::SourceError& error) {
        return fail(ExitCode::kInput, error);
    } catch (const OutputError& error) {
        return fail(ExitCode::kOutput, error);
    } catch (const MessageBusError& error) {
        return fail(ExitCode::kMessages, error);
    } catch (const std::exception& error) {
        return fail(ExitCode::kFailure, error);
    }
}
