// Packets as frames, for who looks at each frame once, or wants no more than the counts.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "core/types/frame.hpp"
#include "driver/frame_builder.hpp"

namespace dlod::driver {

/// A FrameBuilder with frames of its own.
class FrameViewer {
  public:
    /// Is given each frame, which is used again afterwards.
    using See = std::function<void(Frame&)>;

    explicit FrameViewer(const SensorInfo& info, See see = {});
    FrameViewer(const FrameViewer&) = delete;
    FrameViewer& operator=(const FrameViewer&) = delete;

    void push(const Packet& packet) { builder_.push(packet); }
    /// Takes what is under construction for a frame: at the end of a capture.
    void flush() { builder_.flush(); }
    const FrameBuilderCounters& counters() const { return builder_.counters(); }

  private:
    std::array<Frame, 2> frames_;  ///< as many as are under construction at most
    std::vector<Frame*> free_;
    See see_;
    FrameBuilder builder_;
};

}  // namespace dlod::driver
