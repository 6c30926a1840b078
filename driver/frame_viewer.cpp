#include "driver/frame_viewer.hpp"

#include <utility>

namespace dlod::driver {

FrameViewer::FrameViewer(const SensorInfo& info, See see)
    : frames_{Frame(info.model), Frame(info.model)},
      free_{&frames_[0], &frames_[1]},
      see_(std::move(see)),
      builder_(
          info, {},
          [this]() -> Frame* {
              if (free_.empty()) return nullptr;
              Frame* const taken = free_.back();
              free_.pop_back();
              return taken;
          },
          [this](Frame* emitted) {
              if (see_) see_(*emitted);
              free_.push_back(emitted);
          }) {}

}  // namespace dlod::driver
