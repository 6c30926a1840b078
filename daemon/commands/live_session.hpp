// One run on a live sensor: everything between its packets and the messages, and the reports on it.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "daemon/clock/host_time_filter.hpp"
#include "daemon/config/config.hpp"
#include "daemon/control/remote_control.hpp"
#include "daemon/output/map_store.hpp"
#include "daemon/output/result_writer.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/publish/session_messages.hpp"
#include "daemon/recorder/recording_source.hpp"
#include "daemon/sensor/sensor_watch.hpp"
#include "daemon/service/log.hpp"
#include "daemon/service/notifier.hpp"
#include "daemon/status/status_board.hpp"
#include "driver/udp_source.hpp"

namespace dlod::daemon {

/// What one session takes over from the one before.
struct LiveStart {
    std::int64_t start_ns = 0;          ///< CLOCK_MONOTONIC of the service's start
    std::uint64_t sessions_before = 0;  ///< each was ended by the sensor's becoming another one
    HostTimeFilter host_time = {};      ///< so that utime never goes back
    bool is_service = false;            ///< goes on where result files cannot be written
};

class LiveSession {
  public:
    /// Opens sockets, LCM and files. @param metadata as the sensor gave it, for the recording
    /// @throws driver::SourceError, MessageBusError; OutputError where it is no service
    LiveSession(const Config& config, const driver::SensorInfo& sensor, const std::string& metadata,
                const LiveStart& start);

    void start();
    /// Ends the reception; what was received is still processed.
    void stop() { pipeline_.stop(); }
    bool done() const { return pipeline_.done(); }
    int done_descriptor() const { return pipeline_.done_descriptor(); }
    /// Once a second: status message, systemd's status line and watchdog, log where the health changes.
    /// @param sensor_trouble what the sensor itself says is wrong; empty: nothing
    void report(const std::string& sensor_trouble);
    /// How the packets were doing between the last two reports.
    SensorWatch::Stream stream() const { return stream_; }
    /// Takes over what can change while it runs.
    void configure(const Config& config);
    /// After done(): rethrows what has failed, writes what is written at the end.
    void finish();
    /// After finish(): for the session that follows.
    LiveStart next_start() const;
    std::string one_line() const { return board_.one_line(); }

  private:
    FrameSinks sinks();
    void publish_pose(PipelineFrame& frame);
    void open_results();
    void write(PipelineFrame& frame);
    void finish_results();
    void save_last_map();
    CounterList counters();
    void report_clock_step();
    void log_health(const status_t& status);
    void judge_stream(const CounterList& counters, std::int64_t now_ns);

    Config config_;  ///< of the thread that reports: publishing has what it needs beside it
    bool utime_is_sensor_time_;
    std::string description_;
    LiveStart start_;
    driver::UdpSource socket_;
    RecordingSource recording_;
    std::unique_ptr<SessionMessages> messages_;
    MapStore maps_;
    std::unique_ptr<ResultWriter> writer_;
    HostTimeFilter host_time_;
    SensorWatch::Stream stream_ = SensorWatch::Stream::kSilent;
    std::uint64_t unfit_packets_ = 0;  ///< as of the last report
    StatusBoard board_;
    RepeatedWarnings warnings_;
    ServiceNotifier service_;
    driver::Counter output_failures_;
    std::int8_t last_health_ = -1;            ///< none yet: the first one is logged
    Pipeline pipeline_;                       // its threads use all of the above
    std::unique_ptr<RemoteControl> control_;  // last: its thread uses the pipeline
};

}  // namespace dlod::daemon
