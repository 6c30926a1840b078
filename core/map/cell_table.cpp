#include "core/map/cell_table.hpp"

#include <utility>

namespace dlod {

namespace {

constexpr unsigned kFirstBits = 16;

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

void CellTable::insert(const MapPoint& point, std::uint16_t now_ds) {
    const std::uint64_t key = key_of(point);
    const std::size_t slot = slot_of(key);
    if (slots_[slot].key == key) {
        slots_[slot].seen.see(now_ds, rule_);
        return;
    }
    slots_[slot] = {key, point, Persistence(now_ds, rule_)};
    if (++size_ * 5 > slots_.size() * 3) grow();
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
