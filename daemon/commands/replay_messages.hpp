// What a replay says and hears over LCM: the same as a live run.
#pragma once

#include <cstdint>
#include <memory>

#include "daemon/config/config.hpp"
#include "daemon/control/remote_control.hpp"
#include "daemon/output/map_store.hpp"
#include "daemon/pipeline/pipeline.hpp"
#include "daemon/publish/session_messages.hpp"
#include "daemon/status/status_board.hpp"
#include "driver/packet_source.hpp"

namespace dlod::daemon {

class ReplayMessages {
  public:
    /// Opens LCM. @throws MessageBusError
    ReplayMessages(const Config& config, const driver::SensorInfo& sensor);

    /// The messages of a frame, its pose and the rest; utime is the packets' own time.
    void publish_pose(const PipelineFrame& frame) { messages_.publish_pose(frame, frame.header.stamp_ns / 1000); }
    void publish_predicted_pose(const ImuSample& sample) { messages_.publish_predicted_pose(sample); }
    void publish(const PipelineFrame& frame) { messages_.publish(frame, frame.header.stamp_ns / 1000); }
    /// A frame is through.
    void add(const PipelineFrame& frame);
    /// Carries out commands from now on, until stop_listening().
    void listen(Pipeline& pipeline);
    void stop_listening() { control_.reset(); }
    /// Sends status and sensor, each as often as live.
    void report_if_due(const Pipeline& pipeline, const driver::PacketSource& source);
    void report(const Pipeline& pipeline, const driver::PacketSource& source);
    /// Messages that could not be sent so far.
    std::uint64_t failed() const { return messages_.failed(); }

  private:
    LcmConfig config_;
    MapStore maps_;
    SessionMessages messages_;
    StatusBoard board_;
    std::int64_t reported_ns_ = 0;
    std::unique_ptr<RemoteControl> control_;
};

}  // namespace dlod::daemon
