#include "tools/draw/replayed_frame.hpp"

#include <array>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/dynamic_lidar_odometry.hpp"
#include "driver/geometry.hpp"
#include "driver/pcap_source.hpp"

namespace dlod::tools {

ReplayedFrame replay_to(std::uint64_t sequence, const std::filesystem::path& capture, const driver::SensorInfo& sensor,
                        const driver::FrameBuilderConfig& frames, const MethodConfig& method) {
    // The builder works on two frames at a time and hands one out before it takes the next.
    std::array<std::unique_ptr<Frame>, 3> pool;
    std::vector<Frame*> free;
    for (auto& frame : pool) {
        frame = std::make_unique<Frame>(sensor.model);
        free.push_back(frame.get());
    }
    const driver::Geometry geometry(sensor.model);
    DynamicLidarOdometry odometry(sensor.model, method);
    std::optional<ReplayedFrame> wanted;
    driver::FrameBuilder builder(
        sensor, frames,
        [&]() -> Frame* {
            if (free.empty()) return nullptr;
            Frame* frame = free.back();
            free.pop_back();
            return frame;
        },
        [&](Frame* frame) {
            if (!wanted) {
                geometry.process(*frame);
                odometry.process(*frame);
                if (frame->header.sequence == sequence) wanted = ReplayedFrame{*frame, odometry.residual_image()};
            }
            free.push_back(frame);
        });

    driver::PcapSource source(capture);
    for (auto batch = source.next(); batch.status == driver::SourceStatus::kPackets && !wanted; batch = source.next()) {
        for (const auto& packet : batch.packets) builder.push(packet);
    }
    if (!wanted) builder.flush();
    if (!wanted) throw std::runtime_error(capture.string() + ": ends before frame " + std::to_string(sequence));
    return std::move(*wanted);
}

}  // namespace dlod::tools
