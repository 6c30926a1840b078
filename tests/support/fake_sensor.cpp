#include "tests/support/fake_sensor.hpp"

#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>

namespace dlod::test {
namespace {

using Clock = std::chrono::steady_clock;
using nlohmann::json;

constexpr auto kInitialization = std::chrono::milliseconds(250);
constexpr const char* kThisHost = "127.0.0.1";

}  // namespace

FakeSensor::FakeSensor(const SyntheticSensor& sensor) : sensor_(sensor), settings_(settings_of(sensor)) {
    sensor_.speed_mps = 0.0;
    serve();
    udp_ = std::thread([this] { send(); });
}

FakeSensor::~FakeSensor() {
    stopping_ = true;
    server_.stop();
    http_.join();
    udp_.join();
}

json FakeSensor::settings_of(const SyntheticSensor& sensor) {
    return {{"lidar_mode", std::to_string(sensor.columns) + "x10"},
            {"timestamp_mode", "TIME_FROM_INTERNAL_OSC"},
            {"udp_dest", kThisHost},
            {"udp_port_imu", sensor.imu_port},
            {"udp_port_lidar", sensor.lidar_port},
            {"udp_profile_lidar", "RNG15_RFL8_NIR8"}};
}

void FakeSensor::serve() {
    const auto reply = [this](httplib::Response& response, const json& body) {
        const std::lock_guard lock(mutex_);
        const bool up = answers && plugged_in_;
        response.status = up ? 200 : 503;
        response.set_content(up ? body.dump() : "not up", "application/json");
    };
    server_.Get("/api/v1/sensor/metadata", [this, reply](const httplib::Request&, httplib::Response& response) {
        SyntheticSensor now = sensor();
        {
            const std::lock_guard lock(mutex_);
            if (Clock::now() < running_since_) now.status = "INITIALIZING";
        }
        reply(response, json::parse(SyntheticCapture::metadata(now)));
    });
    server_.Get("/api/v1/sensor/cmd/get_config_param",
                [this, reply](const httplib::Request&, httplib::Response& response) { reply(response, settings()); });
    server_.Post("/api/v1/sensor/config", [this, reply](const httplib::Request& request, httplib::Response& response) {
        ++settings_made_;
        set(json::parse(request.body));
        reply(response, json::object());
    });
    port_ = server_.bind_to_any_port(kThisHost);
    http_ = std::thread([this] { server_.listen_after_bind(); });
    while (!server_.is_running()) std::this_thread::yield();
}

void FakeSensor::send() {
    const int socket = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    for (auto begin = Clock::now(); !stopping_; begin += std::chrono::milliseconds(100)) {
        SyntheticSensor now;
        bool sends = false;
        std::uint16_t ports[2] = {};
        {
            const std::lock_guard lock(mutex_);
            now = sensor_;
            now.first_frame = frame_;
            sends = plugged_in_ && Clock::now() >= running_since_ && settings_["udp_dest"] == kThisHost;
            ports[0] = settings_["udp_port_lidar"].get<std::uint16_t>();
            ports[1] = settings_["udp_port_imu"].get<std::uint16_t>();
            ++frame_;
        }
        if (sends) {
            const SyntheticCapture capture(1, now);
            const std::int64_t first_ns = now.epoch_ns + 100'000'000LL * now.first_frame;
            for (const auto& packet : capture.packets()) {
                std::this_thread::sleep_until(begin + std::chrono::nanoseconds(packet.time_ns - first_ns));
                sockaddr_in to{};
                to.sin_family = AF_INET;
                to.sin_port = htons(ports[packet.port == now.lidar_port ? 0 : 1]);
                to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
                ::sendto(socket, packet.data.data(), packet.data.size(), 0, reinterpret_cast<const sockaddr*>(&to),
                         sizeof(to));
            }
        }
        std::this_thread::sleep_until(begin + std::chrono::milliseconds(100));
    }
    ::close(socket);
}

void FakeSensor::begin_anew() {
    ++sensor_.init_id;
    sensor_.epoch_ns = kBootTime_ns;
    frame_ = 0;
    running_since_ = Clock::now() + kInitialization;
}

void FakeSensor::unplug() {
    const std::lock_guard lock(mutex_);
    plugged_in_ = false;
}

void FakeSensor::plug_in() {
    const std::lock_guard lock(mutex_);
    plugged_in_ = true;
    begin_anew();
}

void FakeSensor::restart() {
    const std::lock_guard lock(mutex_);
    begin_anew();
}

void FakeSensor::become(const SyntheticSensor& sensor) {
    const std::lock_guard lock(mutex_);
    const std::uint32_t init_id = sensor_.init_id;
    sensor_ = sensor;
    sensor_.init_id = init_id;
    sensor_.speed_mps = 0.0;
    settings_ = settings_of(sensor);
    begin_anew();
}

void FakeSensor::set(const json& settings) {
    const std::lock_guard lock(mutex_);
    settings_.update(settings);
    if (settings_["udp_dest"] == "@auto") settings_["udp_dest"] = kThisHost;
    const std::string mode = settings_["lidar_mode"];
    sensor_.columns = std::stoi(mode.substr(0, mode.find('x')));
    sensor_.lidar_port = settings_["udp_port_lidar"].get<std::uint16_t>();
    sensor_.imu_port = settings_["udp_port_imu"].get<std::uint16_t>();
    begin_anew();
}

SyntheticSensor FakeSensor::sensor() const {
    const std::lock_guard lock(mutex_);
    return sensor_;
}

json FakeSensor::settings() const {
    const std::lock_guard lock(mutex_);
    return settings_;
}

}  // namespace dlod::test
