#include "daemon/sensor/sensor_watch.hpp"

#include <fmt/format.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <condition_variable>
#include <mutex>
#include <utility>

#include "daemon/config/option.hpp"
#include "daemon/sensor/metadata_cache.hpp"
#include "daemon/sensor/sensor_client.hpp"
#include "driver/metadata.hpp"
#include "driver/network_address.hpp"

namespace dlod::daemon {
namespace {

using Clock = std::chrono::steady_clock;

/// An outstanding request is left to itself after this: a stop must not wait for a sensor.
constexpr auto kPatienceAtTheEnd = std::chrono::milliseconds(200);
constexpr auto kLongestContest = std::chrono::minutes(1);

SensorSettings wanted_settings(const SensorConfig& config) {
    const auto wanted = [](const std::string& text) { return text.empty() ? std::nullopt : std::optional(text); };
    const auto port = [](int number) {
        return number == 0 ? std::nullopt : std::optional(static_cast<std::uint16_t>(number));
    };
    SensorSettings settings;
    settings.udp_dest = wanted(config.configure.udp_dest);
    settings.lidar_mode = wanted(config.configure.lidar_mode);
    settings.lidar_profile = wanted(config.configure.lidar_profile);
    settings.timestamp_mode = wanted(config.configure.timestamp_mode);
    if (settings.udp_dest) {  // a destination is an address and its ports
        settings.lidar_port = port(config.lidar_port);
        settings.imu_port = port(config.imu_port);
    }
    return settings;
}

bool same_beams(const SensorModel& a, const SensorModel& b) {
    return a.height == b.height && a.width == b.width && a.column_window_first == b.column_window_first &&
           a.column_window_last == b.column_window_last && a.frame_period_s == b.frame_period_s &&
           a.altitude_rad == b.altitude_rad && a.azimuth_offset_rad == b.azimuth_offset_rad &&
           a.pixel_shift == b.pixel_shift && a.beam_origin_m == b.beam_origin_m &&
           a.beam_origin_height_m == b.beam_origin_height_m && a.T_sensor_lidar.matrix() == b.T_sensor_lidar.matrix() &&
           a.T_sensor_imu.matrix() == b.T_sensor_imu.matrix();
}

/// What differs between two sensors' streams, in words; empty where the packets of both are decoded alike. A restart
/// alone, which changes the init id, is none of it.
std::string changes(const driver::SensorInfo& before, const driver::SensorInfo& after) {
    std::string text;
    const auto compare = [&](const char* what, const auto& a, const auto& b) {
        if (a != b) text += fmt::format("{}{} {} instead of {}", text.empty() ? "" : ", ", what, b, a);
    };
    compare("product line", before.product_line, after.product_line);
    compare("serial number", before.serial_number, after.serial_number);
    compare("firmware", before.firmware, after.firmware);
    compare("lidar mode", before.lidar_mode, after.lidar_mode);
    compare("profile", before.profile_name, after.profile_name);
    compare("IMU profile", before.imu_profile_name, after.imu_profile_name);
    compare("columns a packet", before.columns_per_packet, after.columns_per_packet);
    compare("lidar port", before.lidar_port, after.lidar_port);
    compare("IMU port", before.imu_port, after.imu_port);
    if (text.empty() && !same_beams(before.model, after.model)) text = "another calibration";
    return text;
}

std::optional<MetadataCache> cache_for(const std::filesystem::path& directory, const std::string& host) {
    if (directory.empty() || host.empty()) return std::nullopt;
    return MetadataCache(directory, host);
}

}  // namespace

class SensorWatch::Worker {
  public:
    Worker(const SensorConfig& config, const std::optional<SensorMetadata>& metadata,
           const std::filesystem::path& state_directory, Timing timing)
        : timing_(timing),
          client_(config.host, timing.timeout),
          cache_(cache_for(state_directory, config.host)),
          file_(metadata ? metadata->name : ""),
          config_(config) {
        if (metadata) in_force_ = driver::parse_metadata(metadata->json, metadata->name);
        if (metadata) offer_ = metadata;
    }

    void run() {
        for (;;) {
            {
                std::unique_lock lock(mutex_);
                const auto pause = stream_ == Stream::kGood && trouble_.empty() ? timing_.calm : timing_.troubled;
                if (looked_) wake_.wait_for(lock, pause, [this] { return stopping_ || urgent_; });
                if (stopping_) break;
                urgent_ = false;
                looked_ = true;
            }
            look();
        }
        const std::lock_guard lock(mutex_);
        ended_ = true;
        wake_.notify_all();
    }

    /// @return true where the thread has come to its end
    bool stop() {
        std::unique_lock lock(mutex_);
        stopping_ = true;
        wake_.notify_all();
        return wake_.wait_for(lock, kPatienceAtTheEnd, [this] { return ended_; });
    }

    void observe(Stream stream) {
        const std::lock_guard lock(mutex_);
        if (stream != stream_ && stream != Stream::kGood) urgent_ = true;
        stream_ = stream;
        if (urgent_) wake_.notify_all();
    }
    void configure(const SensorConfig& config) {
        const std::lock_guard lock(mutex_);
        config_.configure = config.configure;
        urgent_ = true;
        wake_.notify_all();
    }
    std::optional<SensorMetadata> take_metadata() {
        const std::lock_guard lock(mutex_);
        return std::exchange(offer_, std::nullopt);
    }
    std::string trouble() const {
        const std::lock_guard lock(mutex_);
        return trouble_;
    }

  private:
    void look() {
        const SensorConfig config = [this] {
            const std::lock_guard lock(mutex_);
            return config_;
        }();
        std::string trouble;
        try {
            SensorMetadata metadata{client_.fetch_metadata(), "sensor " + config.host};
            const SensorSettings active = active_settings();
            trouble = make_settings(wanted_settings(config), active);
            // What is being set restarts the sensor: its metadata are not the last word.
            if (trouble.empty()) trouble = consider(metadata);
            if (trouble.empty()) trouble = doubt_destination(config, active, status_of(metadata.json));
        } catch (const SensorError& error) {
            fall_back_on_cache(config.host);
            // A sensor whose packets come may keep its web server to itself.
            if (stream() != Stream::kGood || !in_force_) trouble = error.what();
        } catch (const std::exception& error) {  // metadata that are none, or whatever else an answer brings about
            trouble = error.what();
        }
        const std::lock_guard lock(mutex_);
        trouble_ = std::move(trouble);
    }

    /// Old firmware does not tell.
    SensorSettings active_settings() const {
        try {
            return client_.fetch_settings();
        } catch (const SensorError& error) {
            spdlog::debug("{}", error.what());
            return {};
        }
    }

    /// Makes those settings that are not in force. @return what is wrong, empty where all are in force
    std::string make_settings(const SensorSettings& wanted, const SensorSettings& active) {
        if (wanted.empty()) return "";
        const SensorSettings missing = difference(wanted, active, client_.own_address());
        if (missing.empty()) return "";
        const std::string what = fmt::format("sensor {} is not set as sensor.configure asks: {}", client_.host(),
                                             describe_difference(missing, active));
        const auto now = Clock::now();
        if (now < next_settings_) return what + "; another host, or the sensor itself, sets it back: tried again soon";
        const bool again = last_settings_ && now - *last_settings_ < 2 * kLongestContest;
        contest_ = again ? std::min<Clock::duration>(2 * contest_, kLongestContest) : timing_.contest;
        last_settings_ = now;
        next_settings_ = now + contest_;
        spdlog::warn("{}: setting it", what);
        client_.apply(missing);
        return what + "; set, the sensor restarts its stream";
    }

    /// Compares what the sensor says now with what is in force. @return what is wrong
    std::string consider(const SensorMetadata& metadata) {
        const driver::SensorInfo info = driver::parse_metadata(metadata.json, metadata.name);
        const std::string changed = in_force_ ? changes(*in_force_, info) : "";
        if (in_force_ && changed.empty()) {
            keep(metadata.json);
            return "";
        }
        if (!file_.empty()) {
            return fmt::format(
                "{} is not that of sensor.metadata, {}: {}; give its metadata, or leave sensor.metadata "
                "empty to have them asked for",
                metadata.name, file_, changed);
        }
        if (in_force_) spdlog::warn("{} has changed: {}", metadata.name, changed);
        keep(metadata.json);
        in_force_ = info;
        const std::lock_guard lock(mutex_);
        offer_ = metadata;
        return "";
    }

    void keep(const std::string& json) {
        if (!cache_ || json == kept_) return;
        const auto failure = cache_->store(json);
        if (failure) spdlog::warn("{}", *failure);
        kept_ = json;
    }

    void fall_back_on_cache(const std::string& host) {
        if (in_force_ || !cache_) return;
        const auto json = cache_->load();
        if (!json || json == refused_) return;
        try {
            in_force_ = driver::parse_metadata(*json, cache_->path().string());
        } catch (const driver::MetadataError& error) {
            spdlog::warn("{}; the file is not used", error.what());
            refused_ = json;
            return;
        }
        spdlog::warn("sensor {}: going on with the metadata that it gave last time", host);
        const std::lock_guard lock(mutex_);
        offer_ = SensorMetadata{*json, cache_->path().string()};
    }

    /// Why nothing comes from a sensor that answers.
    std::string doubt_destination(const SensorConfig& config, const SensorSettings& active,
                                  const std::string& status) const {
        if (stream() != Stream::kSilent) return "";
        if (status == "STANDBY") {
            return fmt::format("sensor {} is in standby and sends nothing: set its operating_mode to NORMAL",
                               client_.host());
        }
        const std::string own = client_.own_address();
        if (!active.udp_dest || own.empty() || *active.udp_dest == own || *active.udp_dest == "@auto") return "";
        if (!config.multicast_group.empty() && *active.udp_dest == config.multicast_group) return "";
        return fmt::format(
            "sensor {} sends to {}, this host is {}: another host has taken it; set "
            "sensor.configure.udp_dest to '@auto' to have it back",
            client_.host(), *active.udp_dest, own);
    }

    Stream stream() const {
        const std::lock_guard lock(mutex_);
        return stream_;
    }

    const Timing timing_;
    const SensorClient client_;
    const std::optional<MetadataCache> cache_;
    const std::string file_;  ///< with the metadata to be used; empty: the sensor's own

    // The thread's.
    std::optional<driver::SensorInfo> in_force_;
    std::string kept_;
    std::optional<std::string> refused_;  ///< what the cache held that are no metadata
    std::optional<Clock::time_point> last_settings_;
    Clock::time_point next_settings_{};
    Clock::duration contest_{};

    mutable std::mutex mutex_;  ///< guards the rest
    std::condition_variable wake_;
    SensorConfig config_;
    Stream stream_ = Stream::kSilent;
    bool looked_ = false;
    bool urgent_ = false;
    bool stopping_ = false;
    bool ended_ = false;
    std::optional<SensorMetadata> offer_;
    std::string trouble_;
};

SensorWatch::SensorWatch(const SensorConfig& config, const std::optional<SensorMetadata>& metadata,
                         const std::filesystem::path& state_directory, Timing timing)
    : worker_(std::make_shared<Worker>(config, metadata, state_directory, timing)) {
    // Without a host there is nobody to ask.
    if (!config.host.empty()) thread_ = std::thread([worker = worker_] { worker->run(); });
}

SensorWatch::~SensorWatch() {
    if (!thread_.joinable()) return;
    if (worker_->stop()) {
        thread_.join();
    } else {
        thread_.detach();
    }
}

void SensorWatch::observe(Stream stream) {
    worker_->observe(stream);
}
void SensorWatch::configure(const SensorConfig& config) {
    worker_->configure(config);
}
std::optional<SensorMetadata> SensorWatch::take_metadata() {
    return worker_->take_metadata();
}
std::string SensorWatch::trouble() const {
    return worker_->trouble();
}

std::optional<SensorMetadata> configured_metadata(const SensorConfig& config) {
    if (config.metadata.empty()) {
        if (!config.host.empty()) return std::nullopt;
        throw ConfigError(
            "no sensor is named: set sensor.host, its name or address, in the configuration, or sensor.metadata, a "
            "file");
    }
    std::string json = driver::read_metadata(config.metadata);
    driver::parse_metadata(json, config.metadata);
    return SensorMetadata{std::move(json), config.metadata};
}

}  // namespace dlod::daemon
