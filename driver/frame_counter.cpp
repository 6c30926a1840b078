#include "driver/frame_counter.hpp"

namespace dlod::driver {

FrameCounter::FrameCounter(const SensorInfo& info)
    : frames_{Frame(info.model), Frame(info.model)},
      free_{&frames_[0], &frames_[1]},
      builder_(
          info, {},
          [this]() -> Frame* {
              if (free_.empty()) return nullptr;
              Frame* const taken = free_.back();
              free_.pop_back();
              return taken;
          },
          [this](Frame* emitted) { free_.push_back(emitted); }) {}

}  // namespace dlod::driver
