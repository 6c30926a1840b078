// A hash of cubic cells with one point each: the store of the global map.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/map/persistence.hpp"
#include "core/types/image.hpp"

namespace dlod {

/// A point of a map, world frame, metres.
struct MapPoint {
    float x = 0.0F, y = 0.0F, z = 0.0F;
};

/// Points of a map (structure of arrays).
struct MapPoints {
    AlignedVector<float> x, y, z;
    std::size_t size() const { return x.size(); }
    void resize(std::size_t n) {
        for (auto* v : {&x, &y, &z}) v->resize(n);
    }
};

/// Open addressing with linear probing; erasing leaves no tombstones. Grows by doubling, never shrinks by itself.
class CellTable {
  public:
    explicit CellTable(double cell_m, const Persistence::Rule& rule = {});

    std::size_t size() const { return size_; }
    double cell_m() const { return cell_m_; }

    /// Integer coordinates of a cell, about 200 km each way at 0.2 m.
    struct Index {
        std::int32_t x = 0, y = 0, z = 0;
    };
    Index index_of(double x, double y, double z) const {
        return {static_cast<std::int32_t>(std::floor(x * inverse_cell_)),
                static_cast<std::int32_t>(std::floor(y * inverse_cell_)),
                static_cast<std::int32_t>(std::floor(z * inverse_cell_))};
    }

    /// Keeps the point unless its cell holds one already, which has then been seen again.
    void insert(const MapPoint& point, std::uint16_t now_ds = 0) { insert(key_of(point), point, now_ds); }
    /// The same for many, in their order.
    void insert(const MapPoints& points, std::uint16_t now_ds);
    /// The point of a cell, or nullptr. Valid until the next change.
    const MapPoint* find(const Index& index) const;
    /// Forgets a cell; false where it was empty.
    bool erase(const Index& index);

    /// Number of slots, for walking over the table piece by piece.
    std::size_t slots() const { return slots_.size(); }
    /// The point in a slot, or nullptr.
    const MapPoint* at(std::size_t slot) const { return slots_[slot].key != kEmpty ? &slots_[slot].point : nullptr; }
    /// When the point in a filled slot was seen.
    const Persistence& seen(std::size_t slot) const { return slots_[slot].seen; }

    /// Forgets the cells for which `keep(point)` is false.
    template <class Keep>
    void retain(Keep keep) {
        std::vector<Slot> old(slots_.size());
        old.swap(slots_);
        size_ = 0;
        for (const Slot& slot : old) {
            if (slot.key != kEmpty && keep(slot.point)) insert_new(slot);
        }
    }

    /// A cell's point, and the key that orders the cells.
    struct Entry {
        std::uint64_t key = 0;
        MapPoint point;
    };
    /// The cells for which `take(persistence)` is true, in no order.
    template <class Take>
    std::vector<Entry> entries(Take take) const {
        std::vector<Entry> taken;
        taken.reserve(size_);
        for (const Slot& slot : slots_) {
            if (slot.key != kEmpty && take(slot.seen)) taken.push_back({slot.key, slot.point});
        }
        return taken;
    }
    /// Points by ascending cell: the order depends on the cells alone, not on when they came.
    static std::vector<MapPoint> sorted(std::vector<Entry> entries) {
        std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) { return a.key < b.key; });
        std::vector<MapPoint> points(entries.size());
        std::transform(entries.begin(), entries.end(), points.begin(), [](const Entry& e) { return e.point; });
        return points;
    }
    template <class Take>
    std::vector<MapPoint> sorted(Take take) const {
        return sorted(entries(take));
    }
    std::vector<MapPoint> sorted() const {
        return sorted(entries([](const Persistence&) { return true; }));
    }

  private:
    struct Slot {
        std::uint64_t key = kEmpty;
        MapPoint point;
        Persistence seen;
    };
    static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};

    static std::uint64_t key_of(const Index& i);
    std::uint64_t key_of(const MapPoint& p) const { return key_of(index_of(p.x, p.y, p.z)); }
    std::size_t home(std::uint64_t key) const {
        return static_cast<std::size_t>((key * 0x9E3779B97F4A7C15ULL) >> shift_);
    }
    std::size_t slot_of(std::uint64_t key) const;
    void insert(std::uint64_t key, const MapPoint& point, std::uint16_t now_ds);
    void insert_new(const Slot& slot);
    void grow();

    double cell_m_;
    double inverse_cell_;
    Persistence::Rule rule_;
    std::vector<Slot> slots_;
    unsigned shift_;
    std::size_t size_ = 0;
    AlignedVector<std::uint64_t> keys_;  ///< of the points at hand
};

}  // namespace dlod
