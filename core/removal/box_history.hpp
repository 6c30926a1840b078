// Where a track has been while it did not count as dynamic (paper, Sec. "Dynamic Points Removal").
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/types/oriented_box.hpp"

namespace dlod {

/// A rolling window of boxes, world frame. A box that hardly differs from the last one is not kept again, so the window
/// spans a long rest as well as the last metres of a walk.
class BoxHistory {
  public:
    static constexpr std::size_t kCapacity = 24;

    void add(const OrientedBox& box);
    /// Appends all boxes, oldest first, and forgets them.
    void release(std::vector<OrientedBox>& out);
    std::size_t size() const { return size_; }

  private:
    std::array<OrientedBox, kCapacity> boxes_;
    std::size_t first_ = 0;
    std::size_t size_ = 0;
};

}  // namespace dlod
