// A row-major image in cache-aligned memory.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <new>
#include <vector>

namespace dlod {

/// Allocator that aligns to a cache line, so that rows can be read with aligned vector loads.
template <class T>
struct CacheAlignedAllocator {
    using value_type = T;
    static constexpr std::align_val_t kAlignment{64};
    CacheAlignedAllocator() = default;
    template <class U>
    CacheAlignedAllocator(const CacheAlignedAllocator<U>&) noexcept {}
    T* allocate(std::size_t n) { return static_cast<T*>(::operator new(n * sizeof(T), kAlignment)); }
    void deallocate(T* p, std::size_t) noexcept { ::operator delete(p, kAlignment); }
    friend bool operator==(const CacheAlignedAllocator&, const CacheAlignedAllocator&) { return true; }
};

template <class T>
using AlignedVector = std::vector<T, CacheAlignedAllocator<T>>;

/// H x W values, row-major: pixel index = row * width + column. Row 0 is the top beam.
template <class T>
class Image {
  public:
    Image() = default;
    Image(int height, int width, T value = T{}) { resize(height, width, value); }

    void resize(int height, int width, T value = T{}) {
        height_ = height;
        width_ = width;
        values_.assign(static_cast<std::size_t>(height) * static_cast<std::size_t>(width), value);
    }
    void fill(T value) { std::fill(values_.begin(), values_.end(), value); }

    int height() const { return height_; }
    int width() const { return width_; }
    std::size_t size() const { return values_.size(); }
    T* data() { return values_.data(); }
    const T* data() const { return values_.data(); }
    T* row(int r) { return values_.data() + static_cast<std::size_t>(r) * static_cast<std::size_t>(width_); }
    const T* row(int r) const { return values_.data() + static_cast<std::size_t>(r) * static_cast<std::size_t>(width_); }
    T& operator()(int r, int c) { return row(r)[c]; }
    const T& operator()(int r, int c) const { return row(r)[c]; }
    T& operator[](std::size_t pixel) { return values_[pixel]; }
    const T& operator[](std::size_t pixel) const { return values_[pixel]; }

  private:
    int height_ = 0;
    int width_ = 0;
    AlignedVector<T> values_;
};

/// Index of a pixel in a row-major image; it travels with every point that is taken out of the image.
using PixelIndex = std::uint32_t;

}  // namespace dlod
