#include "daemon/control/command_listener.hpp"

#include <fmt/format.h>
#include <lcm/lcm.h>
#include <poll.h>
#include <pthread.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <future>
#include <mutex>
#include <thread>
#include <utility>

#include "daemon/publish/lcm_url.hpp"
#include "daemon/service/log.hpp"
#include "driver/stop_event.hpp"

namespace dlod::daemon {
namespace {

constexpr auto kRetry = std::chrono::seconds(10);
/// How long LCM is given to let go of the thread: it does not while it tries multicast out.
constexpr auto kPatience = std::chrono::milliseconds(500);

struct Destroy {
    void operator()(lcm_t* lcm) const { ::lcm_destroy(lcm); }
};
using Lcm = std::unique_ptr<lcm_t, Destroy>;

}  // namespace

struct CommandListener::State {
    std::string url;
    std::string channel;
    std::function<void(std::span<const std::byte>)> receive;
    driver::StopEvent stop;
    std::mutex receiving;  ///< held while `receive` runs
    bool stopped = false;  ///< guarded by `receiving`
    RepeatedWarnings warnings{std::chrono::minutes(10)};

    std::promise<void> ended;  ///< kept when the thread has nothing more to do
    std::thread thread;

    void listen();
    void listen_until_failure(lcm_t* lcm);
    /// @return false where told to stop
    bool wait(int descriptor, std::chrono::milliseconds timeout);
    bool is_stopped() { return !wait(-1, std::chrono::milliseconds(0)); }
};

bool CommandListener::State::wait(int descriptor, std::chrono::milliseconds timeout) {
    pollfd watched[] = {{stop.fd(), POLLIN, 0}, {descriptor, POLLIN, 0}};
    ::poll(watched, 2, static_cast<int>(timeout.count()));
    return (watched[0].revents & POLLIN) == 0;
}

void CommandListener::State::listen() {
    do {
        const Lcm lcm(has_route(url) ? ::lcm_create(url.empty() ? nullptr : url.c_str()) : nullptr);
        if (lcm) listen_until_failure(lcm.get());
        if (is_stopped()) return;
        warnings.warn("deaf",
                      fmt::format("commands on {} cannot be received: {}. It is tried again every {} s", channel,
                                  can_be_blocked(url) ? "the server of lcm.url cannot be reached, or has hung up"
                                                      : "multicast does not work; see dlod doctor",
                                  kRetry.count()));
    } while (wait(-1, kRetry));
}

void CommandListener::State::listen_until_failure(lcm_t* lcm) {
    const auto handler = [](const lcm_recv_buf_t* buffer, const char*, void* user) {
        auto& state = *static_cast<State*>(user);
        const std::lock_guard lock(state.receiving);
        if (!state.stopped)
            state.receive(std::as_bytes(std::span(static_cast<char*>(buffer->data), buffer->data_size)));
    };
    // A subscription is a regular expression: this one means the channel as it is written.
    if (::lcm_subscribe(lcm, ("\\Q" + channel + "\\E").c_str(), handler, this) == nullptr) return;
    const int descriptor = ::lcm_get_fileno(lcm);
    // What was left behind here while LCM tried multicast out touches nothing that the program's end takes down.
    if (descriptor < 0 || is_stopped()) return;
    spdlog::debug("listening for commands on {}", channel);
    while (wait(descriptor, std::chrono::milliseconds(-1))) {
        if (::lcm_handle_timeout(lcm, 0) < 0) return;
    }
}

CommandListener::CommandListener(const std::string& url, const std::string& channel,
                                 std::function<void(std::span<const std::byte>)> receive)
    : state_(std::make_shared<State>()) {
    state_->url = url;
    state_->channel = channel;
    state_->receive = std::move(receive);
    state_->thread = std::thread([state = state_] {
        ::pthread_setname_np(::pthread_self(), "dlod-commands");
        state->listen();
        state->ended.set_value();
    });
}

CommandListener::~CommandListener() {
    state_->stop.set();
    {
        const std::lock_guard lock(state_->receiving);
        state_->stopped = true;
    }
    if (state_->ended.get_future().wait_for(kPatience) == std::future_status::ready) {
        state_->thread.join();
    } else {
        state_->thread.detach();
    }
}

bool CommandListener::can_listen(const std::string& url) {
    return url.empty() || url.starts_with("udpm:") || url.starts_with("tcpq:");
}

}  // namespace dlod::daemon
