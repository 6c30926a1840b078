#pragma once

#include <cstdint>

#include "core/types/frame.hpp"
#include "daemon/pipeline/admission.hpp"
#include "daemon/pipeline/stage_times.hpp"

namespace dlod::daemon {

/// A pooled frame with what only the daemon wants to know of it.
struct PipelineFrame : Frame {
    using Frame::Frame;

    StageTimes times;
    std::int64_t emitted_ns = 0;   ///< CLOCK_MONOTONIC when the frame builder gave it out
    std::int64_t received_ns = 0;  ///< CLOCK_MONOTONIC when the kernel received its last packet; replay: as emitted_ns
    Admission::Mark admission;
    std::int64_t utime_us = 0;     ///< of its messages
    float pose_latency_ms = 0.0F;  ///< from its last packet's receipt to the publication of its pose
    float latency_ms = 0.0F;       ///< and to the end of publishing
};

}  // namespace dlod::daemon
