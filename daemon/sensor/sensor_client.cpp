#include "daemon/sensor/sensor_client.hpp"

#include <httplib.h>

#include <nlohmann/json.hpp>
#include <utility>

namespace dlod::daemon {
namespace {

using nlohmann::json;

constexpr const char* kMetadataPath = "/api/v1/sensor/metadata";
constexpr const char* kConfigPath = "/api/v1/sensor/config?reinit=true&persist=false";
constexpr std::size_t kMaxAnswer = 4U << 20U;  // metadata are about 10 kB

httplib::Client connect(const std::string& host, std::chrono::milliseconds timeout) {
    httplib::Client client("http://" + host);
    client.set_connection_timeout(timeout);
    client.set_read_timeout(timeout);
    client.set_write_timeout(timeout);
    return client;
}

/// The body of a good answer, else a SensorError that says what the sensor said.
std::string body_of(const httplib::Result& result, const std::string& host, const std::string& request) {
    const std::string what = "sensor " + host + ": " + request;
    if (!result) {
        throw SensorError(what + ": " + httplib::to_string(result.error()) +
                          " (is the sensor powered and connected, and sensor.host right?)");
    }
    if (result->status != 200) {
        throw SensorError(what + ": status " + std::to_string(result->status) + " " + result->body.substr(0, 200));
    }
    if (result->body.size() > kMaxAnswer) throw SensorError(what + ": answer too large to be an Ouster's");
    return result->body;
}

/// Metadata carry the sensor's state: nested in `sensor_info`, or at the top in the flat form.
std::string status_of(const json& metadata) {
    const json& info = metadata.contains("sensor_info") ? metadata["sensor_info"] : metadata;
    return info.is_object() && info.contains("status") && info["status"].is_string() ? info["status"].get<std::string>()
                                                                                     : "RUNNING";
}

}  // namespace

SensorClient::SensorClient(std::string host, std::chrono::milliseconds timeout)
    : host_(std::move(host)), timeout_(timeout) {}

std::string SensorClient::fetch_metadata() const {
    auto client = connect(host_, timeout_);
    std::string text = body_of(client.Get(kMetadataPath), host_, std::string("GET ") + kMetadataPath);
    const json metadata = json::parse(text, nullptr, /*allow_exceptions=*/false);
    if (!metadata.is_object()) {
        throw SensorError("sensor " + host_ + ": GET " + kMetadataPath +
                          ": no JSON object (is sensor.host an Ouster?)");
    }
    const std::string status = status_of(metadata);
    if (status != "RUNNING" && status != "STANDBY") {
        throw SensorError("sensor " + host_ + " is not ready yet: its status is " + status);
    }
    return text;
}

void SensorClient::apply(const SensorSettings& settings) const {
    json body = json::object();
    if (settings.udp_dest) body["udp_dest"] = *settings.udp_dest;
    if (settings.lidar_port) body["udp_port_lidar"] = *settings.lidar_port;
    if (settings.imu_port) body["udp_port_imu"] = *settings.imu_port;
    if (settings.lidar_mode) body["lidar_mode"] = *settings.lidar_mode;
    if (settings.lidar_profile) body["udp_profile_lidar"] = *settings.lidar_profile;
    if (settings.timestamp_mode) body["timestamp_mode"] = *settings.timestamp_mode;
    auto client = connect(host_, timeout_);
    body_of(client.Post(kConfigPath, body.dump(), "application/json"), host_, std::string("POST ") + kConfigPath);
}

}  // namespace dlod::daemon
