#include "core/map/cell_table.hpp"

#include <cmath>
#include <utility>

#include "core/types/multiversion.hpp"

namespace dlod {

namespace {

constexpr unsigned kFirstBits = 16;
constexpr std::size_t kPrefetch = 12;  // points: about the latency of main memory

inline __attribute__((always_inline)) std::uint64_t key_of_cell(std::int32_t x, std::int32_t y, std::int32_t z) {
    constexpr std::int64_t kMask = (std::int64_t{1} << 21U) - 1;
    constexpr std::int64_t kOffset = std::int64_t{1} << 20U;
    const std::int64_t key = ((x + kOffset) & kMask) << 42U | ((y + kOffset) & kMask) << 21U | ((z + kOffset) & kMask);
    return static_cast<std::uint64_t>(key);
}

DLOD_MULTIVERSION
void find_keys(std::size_t count, const float* __restrict x, const float* __restrict y, const float* __restrict z,
               double inverse_cell, std::uint64_t* __restrict key) {
    for (std::size_t i = 0; i < count; ++i) {
        key[i] = key_of_cell(static_cast<std::int32_t>(std::floor(static_cast<double>(x[i]) * inverse_cell)),
                             static_cast<std::int32_t>(std::floor(static_cast<double>(y[i]) * inverse_cell)),
                             static_cast<std::int32_t>(std::floor(static_cast<double>(z[i]) * inverse_cell)));
    }
}

}  // namespace

CellTable::CellTable(double cell_m, const Persistence::Rule& rule)
    : cell_m_(cell_m),
      inverse_cell_(1.0 / cell_m),
      rule_(rule),
      slots_(std::size_t{1} << kFirstBits),
      shift_(64 - kFirstBits) {}

// The slot that holds the key, or the empty one where it would go.
std::size_t CellTable::slot_of(std::uint64_t key) const {
    const std::size_t mask = slots_.size() - 1;
    std::size_t slot = home(key);
    while (slots_[slot].key != kEmpty && slots_[slot].key != key) slot = (slot + 1) & mask;
    return slot;
}

void CellTable::insert_new(const Slot& slot) {
    slots_[slot_of(slot.key)] = slot;
    ++size_;
}

void CellTable::insert(std::uint64_t key, const MapPoint& point, std::uint16_t now_ds) {
    const std::size_t slot = slot_of(key);
    if (slots_[slot].key == key) {
        slots_[slot].seen.see(now_ds, rule_);
        return;
    }
    slots_[slot] = {key, point, Persistence(now_ds, rule_)};
    if (++size_ * 5 > slots_.size() * 3) grow();
}

void CellTable::insert(const MapPoints& points, std::uint16_t now_ds) {
    const std::size_t count = points.size();
    keys_.resize(std::max(keys_.size(), count));
    find_keys(count, points.x.data(), points.y.data(), points.z.data(), inverse_cell_, keys_.data());
    for (std::size_t i = 0; i < count; ++i) {
        if (i + kPrefetch < count) __builtin_prefetch(&slots_[home(keys_[i + kPrefetch])], 1);
        // Neighbours in the image are neighbours in space; seen twice at once is seen once.
        if (i > 0 && keys_[i] == keys_[i - 1]) continue;
        insert(keys_[i], {points.x[i], points.y[i], points.z[i]}, now_ds);
    }
}

std::uint64_t CellTable::key_of(const Index& i) {
    return key_of_cell(i.x, i.y, i.z);
}

const MapPoint* CellTable::find(const Index& index) const {
    return at(slot_of(key_of(index)));
}

bool CellTable::erase(const Index& index) {
    const std::size_t mask = slots_.size() - 1;
    std::size_t hole = slot_of(key_of(index));
    if (slots_[hole].key == kEmpty) return false;
    // Later members of the same run move up where the hole would cut them off from their home.
    for (std::size_t next = (hole + 1) & mask; slots_[next].key != kEmpty; next = (next + 1) & mask) {
        if (((next - home(slots_[next].key)) & mask) >= ((next - hole) & mask)) {
            slots_[hole] = slots_[next];
            hole = next;
        }
    }
    slots_[hole].key = kEmpty;
    --size_;
    return true;
}

void CellTable::grow() {
    std::vector<Slot> old(slots_.size() * 2);
    old.swap(slots_);
    --shift_;
    size_ = 0;
    for (const Slot& slot : old) {
        if (slot.key != kEmpty) insert_new(slot);
    }
}

}  // namespace dlod
