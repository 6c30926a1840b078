// One frame of a capture with everything that the method knows of it.
#pragma once

#include <filesystem>

#include "core/method_config.hpp"
#include "core/types/frame.hpp"
#include "driver/frame_builder.hpp"
#include "driver/metadata.hpp"

namespace dlod::tools {

struct ReplayedFrame {
    Frame frame;
    Image<float> residual_m;  ///< the residual image of the scan-to-submap registration, as the method keeps it
};

/// Runs the method, in its sequential form, over the capture up to the frame of that sequence number: it is
/// deterministic, so what comes out is what the daemon had. Throws std::runtime_error when the capture ends before.
ReplayedFrame replay_to(std::uint64_t sequence, const std::filesystem::path& capture, const driver::SensorInfo& sensor,
                        const driver::FrameBuilderConfig& frames, const MethodConfig& method);

}  // namespace dlod::tools
