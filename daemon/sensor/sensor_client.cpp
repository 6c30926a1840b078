#include "daemon/sensor/sensor_client.hpp"

#include <httplib.h>
#include <netdb.h>
#include <sys/socket.h>

#include <cstring>
#include <memory>
#include <nlohmann/json.hpp>
#include <utility>

#include "daemon/sensor/request_limit.hpp"
#include "driver/network_address.hpp"
#include "driver/printable.hpp"

namespace dlod::daemon {
namespace {

using nlohmann::json;

constexpr const char* kMetadataPath = "/api/v1/sensor/metadata";
constexpr const char* kActiveSettingsPath = "/api/v1/sensor/cmd/get_config_param?args=active";
constexpr const char* kConfigPath = "/api/v1/sensor/config?reinit=true&persist=false";
constexpr std::size_t kMaxAnswer = 4U << 20U;  // metadata are about 10 kB
constexpr int kMostTimeouts = 5;               // for an answer that comes little by little

/// Without port and brackets.
std::string name_of(const std::string& host) {
    if (!host.empty() && host.front() == '[') return host.substr(1, host.find(']') - 1);
    const auto colon = host.find(':');
    return colon == host.rfind(':') ? host.substr(0, colon) : host;
}

/// The host's first address; nothing, and why, where the name cannot be resolved.
std::optional<driver::SocketAddress> resolve(const std::string& host, std::string* why = nullptr) {
    addrinfo hints{};
    hints.ai_socktype = SOCK_DGRAM;
    addrinfo* first = nullptr;
    if (const int error = ::getaddrinfo(name_of(host).c_str(), "80", &hints, &first); error != 0) {
        if (why != nullptr) *why = ::gai_strerror(error);
        return std::nullopt;
    }
    const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> found(first, &::freeaddrinfo);
    driver::SocketAddress address;
    std::memcpy(&address.storage, found->ai_addr, found->ai_addrlen);
    address.length = found->ai_addrlen;
    return address;
}

/// Why there is no answer, and what to do.
std::string without_answer(const std::string& host, httplib::Error error) {
    std::string why;
    if (error == httplib::Error::Connection && !resolve(host, &why)) {
        return "the name cannot be resolved: " + why +
               " (names in .local need mDNS: apt install avahi-daemon libnss-mdns; or give the address)";
    }
    const bool no_connection = error == httplib::Error::Connection || error == httplib::Error::ConnectionTimeout;
    return (no_connection ? "no connection" : "no answer: " + httplib::to_string(error)) +
           " (is the sensor powered and connected, and sensor.host right?)";
}

/// The body of a good answer, else a SensorError that says what the sensor said.
std::string request(const std::string& host, std::chrono::milliseconds timeout, const std::string& method,
                    const std::string& path, const std::string& body = "") {
    httplib::Client client("http://" + host);
    client.set_connection_timeout(timeout);
    client.set_read_timeout(timeout);
    client.set_write_timeout(timeout);
    httplib::Request request;
    request.method = method;
    request.path = path;
    request.body = body;
    if (!body.empty()) request.set_header("Content-Type", "application/json");
    std::string answer;
    request.content_receiver = [&](const char* data, std::size_t size, std::uint64_t, std::uint64_t) {
        answer.append(data, size);
        return answer.size() <= kMaxAnswer;
    };
    RequestLimit limit(kMaxAnswer, kMostTimeouts * timeout, [&] { client.stop(); });
    client.set_socket_options([&](int socket) { limit.set_socket(socket); });
    const httplib::Result result = client.send(request);

    const std::string what = "sensor " + host + ": " + method + " " + path;
    if (answer.size() > kMaxAnswer || limit.too_large())
        throw SensorError(what + ": answer too large to be an Ouster's");
    if (!result) throw SensorError(what + ": " + without_answer(host, result.error()));
    if (result->status != 200) {
        // A page for people says no more than its title.
        const bool is_page = answer.starts_with('<');
        throw SensorError(what + ": status " + std::to_string(result->status) + " " +
                          driver::printable(is_page ? result->reason : answer));
    }
    return answer;
}

/// Metadata carry the sensor's state: nested in `sensor_info`, or at the top in the flat form.
std::string state_of(const json& metadata) {
    const json& info = metadata.contains("sensor_info") ? metadata["sensor_info"] : metadata;
    return info.is_object() && info.contains("status") && info["status"].is_string()
               ? driver::printable(info["status"].get_ref<const std::string&>())
               : "RUNNING";
}

/// Calls `visit` with the name of each setting in the sensor's API and the member for it.
template <class Settings, class Visitor>
void visit_settings(Settings& settings, const Visitor& visit) {
    visit("udp_dest", settings.udp_dest);
    visit("udp_port_lidar", settings.lidar_port);
    visit("udp_port_imu", settings.imu_port);
    visit("lidar_mode", settings.lidar_mode);
    visit("udp_profile_lidar", settings.lidar_profile);
    visit("timestamp_mode", settings.timestamp_mode);
}

json to_json(const SensorSettings& settings) {
    json body = json::object();
    visit_settings(settings, [&](const char* name, const auto& setting) {
        if (setting) body[name] = *setting;
    });
    return body;
}

}  // namespace

SensorClient::SensorClient(std::string host, std::chrono::milliseconds timeout)
    : host_(std::move(host)), timeout_(timeout) {}

std::string SensorClient::fetch_metadata() const {
    std::string text = request(host_, timeout_, "GET", kMetadataPath);
    const json metadata = json::parse(text, nullptr, /*allow_exceptions=*/false);
    if (!metadata.is_object()) {
        throw SensorError("sensor " + host_ + ": GET " + kMetadataPath +
                          ": no JSON object (is sensor.host an Ouster?)");
    }
    const std::string status = state_of(metadata);
    if (status != "RUNNING" && status != "STANDBY") {
        throw SensorError("sensor " + host_ + " is not ready yet: its status is " + status);
    }
    return text;
}

SensorSettings SensorClient::fetch_settings() const {
    const std::string text = request(host_, timeout_, "GET", kActiveSettingsPath);
    const json answer = json::parse(text, nullptr, /*allow_exceptions=*/false);
    SensorSettings settings;
    if (!answer.is_object()) return settings;
    visit_settings(settings, [&](const char* name, auto& setting) {
        using Value = typename std::remove_reference_t<decltype(setting)>::value_type;
        if (!answer.contains(name)) return;
        const json& value = answer[name];
        if constexpr (std::is_same_v<Value, std::string>) {
            if (value.is_string()) setting = driver::printable(value.template get_ref<const std::string&>());
        } else {
            if (value.is_number_unsigned()) setting = value.template get<Value>();
        }
    });
    // Firmware before 2.0 calls it so.
    if (!settings.udp_dest && answer.contains("udp_ip") && answer["udp_ip"].is_string()) {
        settings.udp_dest = driver::printable(answer["udp_ip"].get_ref<const std::string&>());
    }
    return settings;
}

std::string SensorClient::own_address() const {
    const auto sensor = resolve(host_);
    const auto own = sensor ? driver::source_address_for(*sensor) : std::nullopt;
    return own ? driver::to_string(*own) : "";
}

void SensorClient::apply(const SensorSettings& settings) const {
    request(host_, timeout_, "POST", kConfigPath, to_json(settings).dump());
}

SensorSettings difference(const SensorSettings& wanted, const SensorSettings& active, const std::string& own_address) {
    SensorSettings missing;
    const json in_force = to_json(active);
    const json asked = to_json(wanted);
    visit_settings(missing, [&](const char* name, auto& setting) {
        using Value = typename std::remove_reference_t<decltype(setting)>::value_type;
        if (!asked.contains(name)) return;
        if (in_force.contains(name)) {
            const bool means_this_host = asked[name] == "@auto";
            if (in_force[name] == asked[name] || (means_this_host && in_force[name] == own_address)) return;
        }
        setting = asked[name].template get<Value>();
    });
    return missing;
}

std::string describe_difference(const SensorSettings& missing, const SensorSettings& active) {
    const auto text_of = [](const json& value) { return value.is_string() ? value.get<std::string>() : value.dump(); };
    const json asked = to_json(missing);
    const json in_force = to_json(active);
    std::string text;
    for (const auto& [name, value] : asked.items()) {
        text += (text.empty() ? "" : ", ") + name + " " +
                (in_force.contains(name) ? text_of(in_force[name]) : "something") + " instead of " + text_of(value);
    }
    return text;
}

std::string status_of(const std::string& metadata) {
    const json parsed = json::parse(metadata, nullptr, /*allow_exceptions=*/false);
    return parsed.is_object() ? state_of(parsed) : "RUNNING";
}

}  // namespace dlod::daemon
