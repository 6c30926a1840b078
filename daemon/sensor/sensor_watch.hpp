// Keeps an eye on the sensor over HTTP while its packets come, or do not: where a live run gets the metadata from, and
// how it learns that they have changed.
#pragma once

#include <chrono>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <thread>

#include "daemon/config/config.hpp"

namespace dlod::daemon {

/// Metadata as a sensor or a file gave them; they have been parsed without error.
struct SensorMetadata {
    std::string json;
    std::string name;  ///< of the file or sensor, for messages
};

/// Asks the sensor in a thread of its own: every few seconds while packets fit its metadata, more often when something
/// is wrong. It tells
/// - the first metadata, which are awaited as long as it takes; those that the state directory keeps from the last time
///   serve while the sensor does not answer,
/// - new ones when the sensor sends otherwise than those in force say: it was replaced, its firmware or mode changed,
/// - what is wrong: no answer, still starting, in standby, sending to another host.
/// Settings that the configuration asks for are made where they are not in force. Who sets them back is outdone, ever
/// more slowly.
class SensorWatch {
  public:
    struct Timing {
        std::chrono::milliseconds calm{10'000};     ///< between questions while all is well
        std::chrono::milliseconds troubled{1'000};  ///< while not
        std::chrono::milliseconds timeout{1'000};   ///< of a request
        std::chrono::milliseconds contest{2'000};   ///< before settings are made again; doubles every time
    };

    /// @param metadata those of the configured file, to compare with; nothing: the sensor's own are taken
    /// @param state_directory where metadata are kept; empty: nowhere
    SensorWatch(const SensorConfig& config, const std::optional<SensorMetadata>& metadata,
                const std::filesystem::path& state_directory, Timing timing);
    SensorWatch(const SensorConfig& config, const std::optional<SensorMetadata>& metadata,
                const std::filesystem::path& state_directory)
        : SensorWatch(config, metadata, state_directory, Timing()) {}
    /// Does not wait for an answer that is outstanding.
    ~SensorWatch();
    SensorWatch(const SensorWatch&) = delete;
    SensorWatch& operator=(const SensorWatch&) = delete;

    /// How the stream is doing: anything but `good` makes the watch look at once.
    enum class Stream { kGood, kSilent, kUnfit };
    void observe(Stream stream);

    /// Takes the settings of a new configuration.
    void configure(const SensorConfig& config);

    /// Metadata to go on with, each only once.
    std::optional<SensorMetadata> take_metadata();

    /// What is wrong and what to do; empty: nothing.
    std::string trouble() const;

  private:
    class Worker;
    std::shared_ptr<Worker> worker_;  ///< outlives this where a request is outstanding
    std::thread thread_;
};

/// The metadata of the file that the configuration names, or nothing where it names none.
/// @throws driver::MetadataError where the file cannot be read or used, ConfigError where neither file nor host are
/// configured
std::optional<SensorMetadata> configured_metadata(const SensorConfig& config);

}  // namespace dlod::daemon
