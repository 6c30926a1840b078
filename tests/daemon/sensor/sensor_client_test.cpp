#include "daemon/sensor/sensor_client.hpp"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "daemon/sensor/metadata_cache.hpp"

namespace dlod::daemon {
namespace {

using std::chrono::milliseconds;

/// An Ouster's HTTP side on a loopback port of its own.
class FakeSensor {
  public:
    FakeSensor() {
        server_.Get("/api/v1/sensor/metadata", [this](const httplib::Request&, httplib::Response& response) {
            response.status = status;
            if (!endless) return response.set_content(metadata, "application/json");
            response.set_chunked_content_provider("application/json", [this](std::size_t, httplib::DataSink& sink) {
                std::this_thread::sleep_for(pause);
                return sink.write(metadata.data(), metadata.size());
            });
        });
        server_.Post("/api/v1/sensor/config", [this](const httplib::Request& request, httplib::Response& response) {
            posted = request.body;
            query = request.get_param_value("reinit") + "," + request.get_param_value("persist");
            response.status = status;
        });
        port_ = server_.bind_to_any_port("127.0.0.1");
        thread_ = std::thread([this] { server_.listen_after_bind(); });
        while (!server_.is_running()) std::this_thread::yield();
    }
    ~FakeSensor() {
        server_.stop();
        thread_.join();
    }
    std::string host() const { return "127.0.0.1:" + std::to_string(port_); }

    int status = 200;
    std::atomic<bool> endless{false};  ///< `metadata` again and again...
    milliseconds pause{0};             ///< ... after this
    std::string metadata = R"({"sensor_info": {"status": "RUNNING", "prod_line": "OS-0-128"}})";
    std::string posted;
    std::string query;

  private:
    httplib::Server server_;
    int port_ = 0;
    std::thread thread_;
};

std::string error_of(const SensorClient& client) {
    try {
        client.fetch_metadata();
    } catch (const SensorError& error) {
        return error.what();
    }
    return "";
}

TEST(SensorClient, FetchesMetadataAsTheyAre) {
    FakeSensor sensor;
    EXPECT_EQ(SensorClient(sensor.host()).fetch_metadata(), sensor.metadata);
}

TEST(SensorClient, ASensorThatStillStartsIsNotReady) {
    FakeSensor sensor;
    sensor.metadata = R"({"sensor_info": {"status": "INITIALIZING"}})";
    EXPECT_NE(error_of(SensorClient(sensor.host())).find("INITIALIZING"), std::string::npos);
    sensor.metadata = R"({"status": "WARMUP", "prod_line": "OS-1-64"})";
    EXPECT_NE(error_of(SensorClient(sensor.host())).find("WARMUP"), std::string::npos);
}

TEST(SensorClient, ErrorsNameHostRequestAndAnswer) {
    FakeSensor sensor;
    sensor.status = 503;
    sensor.metadata = "booting";
    const std::string error = error_of(SensorClient(sensor.host()));
    for (const std::string& part :
         {sensor.host(), std::string("/api/v1/sensor/metadata"), std::string("503"), std::string("booting")}) {
        EXPECT_NE(error.find(part), std::string::npos) << part << " in: " << error;
    }
    sensor.metadata = "<!DOCTYPE HTML><html><head><title>Error response</title></head></html>";
    const std::string page = error_of(SensorClient(sensor.host()));
    EXPECT_NE(page.find("503"), std::string::npos) << page;
    EXPECT_EQ(page.find('<'), std::string::npos) << page;
}

TEST(SensorClient, WhatIsNoOusterIsSaidSo) {
    FakeSensor sensor;
    sensor.metadata = "<html>a printer</html>";
    EXPECT_NE(error_of(SensorClient(sensor.host())).find("JSON"), std::string::npos);
}

TEST(SensorClient, AnAbsentSensorIsAnErrorWithinTheTimeout) {
    const auto begin = std::chrono::steady_clock::now();
    const std::string absent = error_of(SensorClient("127.0.0.1:1", milliseconds(300)));
    EXPECT_NE(absent.find("127.0.0.1:1"), std::string::npos) << absent;
    EXPECT_NE(absent.find("no connection"), std::string::npos) << absent;
    const std::string unknown = error_of(SensorClient("os-1..local:80", milliseconds(300)));
    EXPECT_NE(unknown.find("cannot be resolved"), std::string::npos) << unknown;
    EXPECT_NE(unknown.find("libnss-mdns"), std::string::npos) << unknown;
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(3));
}

TEST(SensorClient, AnAnswerWithoutEndIsCutOff) {
    FakeSensor sensor;
    sensor.endless = true;
    sensor.metadata = std::string(100'000, ' ');
    EXPECT_NE(error_of(SensorClient(sensor.host())).find("too large"), std::string::npos);
    sensor.metadata = " ";
    sensor.pause = milliseconds(20);
    const auto begin = std::chrono::steady_clock::now();
    EXPECT_NE(error_of(SensorClient(sensor.host(), milliseconds(200))), "");
    EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));
}

/// Answers any request with `begin`, then `again` without end, each after a pause.
class EndlessServer {
  public:
    EndlessServer(const std::string& begin, const std::string& again, milliseconds pause) {
        listening_ = ::socket(AF_INET, SOCK_STREAM, 0);
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        socklen_t length = sizeof address;
        EXPECT_EQ(::bind(listening_, reinterpret_cast<sockaddr*>(&address), length), 0);
        EXPECT_EQ(::listen(listening_, 1), 0);
        ::getsockname(listening_, reinterpret_cast<sockaddr*>(&address), &length);
        port_ = ntohs(address.sin_port);
        thread_ = std::thread([=, this] {
            client_ = ::accept(listening_, nullptr, nullptr);
            bool sent = ::send(client_, begin.data(), begin.size(), MSG_NOSIGNAL) > 0;
            while (sent) {
                std::this_thread::sleep_for(pause);
                sent = ::send(client_, again.data(), again.size(), MSG_NOSIGNAL) > 0;
            }
        });
    }
    ~EndlessServer() {
        ::shutdown(client_, SHUT_RDWR);
        thread_.join();
        ::close(client_);
        ::close(listening_);
    }
    EndlessServer(const EndlessServer&) = delete;
    EndlessServer& operator=(const EndlessServer&) = delete;

    std::string host() const { return "127.0.0.1:" + std::to_string(port_); }

  private:
    int listening_;
    std::atomic<int> client_{-1};
    int port_ = 0;
    std::thread thread_;
};

/// Without a bound these requests would not end, and take all the memory there is.
TEST(SensorClient, WhatComesBeforeAnAnswerIsCutOffToo) {
    const std::string line(60'000, 'x');
    std::string headers;
    while (headers.size() < line.size()) headers += "X-Header: " + std::to_string(headers.size()) + "\r\n";
    for (const auto& [begin, again] : std::vector<std::pair<std::string, std::string>>{
             {"HTTP/1.1 200 OK\r\nX: ", line}, {"HTTP/1.1 200 OK\r\n", headers}, {"HTTP/1.1 ", line}}) {
        EndlessServer server(begin, again, milliseconds(0));
        const std::string error = error_of(SensorClient(server.host()));
        EXPECT_NE(error.find("too large"), std::string::npos) << error;
    }
    for (const std::string begin : {"H", "HTTP/1.1 200 OK\r\nX: "}) {
        EndlessServer server(begin, "x", milliseconds(20));
        const std::string error = error_of(SensorClient(server.host(), milliseconds(100)));
        EXPECT_NE(error.find("no answer"), std::string::npos) << error;
    }
}

TEST(SensorClient, WhatASensorSaysIsOneLineOfTheLog) {
    FakeSensor sensor;
    sensor.status = 500;
    sensor.metadata = "broken\nWATCHDOG=1\x1b[31m" + std::string(1000, 'x');
    const std::string error = error_of(SensorClient(sensor.host()));
    EXPECT_EQ(error.find_first_of("\n\x1b"), std::string::npos) << error;
    EXPECT_LT(error.size(), 400U);
    sensor.status = 200;
    sensor.metadata = R"({"sensor_info": {"status": "UP\nSTOPPING=1"}})";
    EXPECT_EQ(error_of(SensorClient(sensor.host())).find('\n'), std::string::npos);
}

TEST(SensorClient, SendsOnlyTheSettingsThatAreGiven) {
    FakeSensor sensor;
    SensorSettings settings;
    settings.udp_dest = "@auto";
    settings.lidar_port = 7512;
    SensorClient(sensor.host()).apply(settings);
    EXPECT_EQ(nlohmann::json::parse(sensor.posted), nlohmann::json({{"udp_dest", "@auto"}, {"udp_port_lidar", 7512}}));
    EXPECT_EQ(sensor.query, "true,false") << "takes effect at once, does not survive a power cycle";
    sensor.status = 400;
    EXPECT_THROW(SensorClient(sensor.host()).apply(settings), SensorError);
}

class MetadataCacheTest : public testing::Test {
  protected:
    void SetUp() override {
        directory_ = std::filesystem::path(testing::TempDir()) / "dlod_metadata_cache";
        std::filesystem::remove_all(directory_);
        std::filesystem::create_directories(directory_);
    }
    void TearDown() override { std::filesystem::remove_all(directory_); }
    std::filesystem::path directory_;
};

TEST_F(MetadataCacheTest, GivesBackWhatWasStoredForThatHost) {
    const MetadataCache cache(directory_, "os-992.local:80");
    EXPECT_FALSE(cache.load().has_value());
    EXPECT_FALSE(cache.store("{\"a\": 1}").has_value());
    EXPECT_FALSE(cache.store("{\"a\": 2}").has_value());
    EXPECT_EQ(cache.load(), "{\"a\": 2}");
    EXPECT_FALSE(MetadataCache(directory_, "os-993.local").load().has_value());
}

TEST_F(MetadataCacheTest, NoHostNameLeavesTheDirectory) {
    const MetadataCache cache(directory_, "../../etc/passwd");
    EXPECT_EQ(cache.path().parent_path(), directory_);
    EXPECT_FALSE(cache.store("x").has_value());
    EXPECT_EQ(cache.load(), "x");
}

TEST_F(MetadataCacheTest, AnUnwritableDirectoryIsAnErrorThatNamesTheFile) {
    const MetadataCache cache(directory_ / "missing", "host");
    const auto error = cache.store("x");
    ASSERT_TRUE(error.has_value());
    EXPECT_NE(error->find("missing"), std::string::npos);
}

}  // namespace
}  // namespace dlod::daemon
