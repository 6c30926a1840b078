// dlod-listen: counts the LCM messages that arrive on each channel.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <map>
#include <string>

#include "tools/command_line.hpp"

namespace {

std::atomic<bool> interrupted{false};

struct Received {
    long messages = 0;
    std::size_t bytes = 0;
    std::size_t largest_bytes = 0;
};

class Listener {
  public:
    void on_message(const lcm::ReceiveBuffer* buffer, const std::string& channel) {
        Received& received = channels_[channel];
        ++received.messages;
        received.bytes += buffer->data_size;
        received.largest_bytes = std::max<std::size_t>(received.largest_bytes, buffer->data_size);
    }
    void print() const {
        std::printf("%-16s %9s %12s %14s\n", "channel", "messages", "mean bytes", "largest bytes");
        for (const auto& [channel, received] : channels_) {
            std::printf("%-16s %9ld %12zu %14zu\n", channel.c_str(), received.messages,
                        received.bytes / static_cast<std::size_t>(received.messages), received.largest_bytes);
        }
    }

  private:
    std::map<std::string, Received> channels_;
};

}  // namespace

int main(int argc, char** argv) {
    CLI::App app{
        "Counts the LCM messages on each channel until it is interrupted (SIGINT, SIGTERM), then prints a table."};
    std::string url;
    double seconds = 0.0;
    app.add_option("--lcm", url, "LCM provider; default: LCM's own");
    app.add_option("--seconds", seconds, "end after this time")->check(CLI::NonNegativeNumber);
    if (const auto code = dlod::tools::parse_command_line(app, argc, argv)) return *code;

    lcm::LCM lcm(url);
    Listener listener;
    if (!lcm.good()) {
        std::fprintf(stderr, "dlod-listen: LCM cannot be opened%s%s: is there a route for multicast?\n",
                     url.empty() ? "" : " at ", url.c_str());
        return 1;
    }
    lcm.subscribe(".*", &Listener::on_message, &listener);
    const auto stop = [](int) { interrupted = true; };
    std::signal(SIGINT, stop);
    std::signal(SIGTERM, stop);
    std::fprintf(stderr, "listening\n");
    const auto start = std::chrono::steady_clock::now();
    while (!interrupted) {
        lcm.handleTimeout(100);
        if (seconds > 0.0 && std::chrono::steady_clock::now() - start > std::chrono::duration<double>(seconds)) break;
    }
    listener.print();
    return 0;
}
