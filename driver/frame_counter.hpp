// What packets would come to as frames, for who wants to know no more than their number and what is wrong with them.
#pragma once

#include <array>
#include <vector>

#include "core/types/frame.hpp"
#include "driver/frame_builder.hpp"

namespace dlod::driver {

/// A FrameBuilder whose frames nobody uses.
class FrameCounter {
  public:
    explicit FrameCounter(const SensorInfo& info);
    FrameCounter(const FrameCounter&) = delete;
    FrameCounter& operator=(const FrameCounter&) = delete;

    void push(const Packet& packet) { builder_.push(packet); }
    /// Counts what is under construction: at the end of a capture.
    void flush() { builder_.flush(); }
    const FrameBuilderCounters& counters() const { return builder_.counters(); }

  private:
    std::array<Frame, 2> frames_;  ///< as many as are under construction at most
    std::vector<Frame*> free_;
    FrameBuilder builder_;
};

}  // namespace dlod::driver
