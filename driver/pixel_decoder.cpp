#include "driver/pixel_decoder.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "core/types/multiversion.hpp"

namespace dlod::driver {
namespace {

static_assert(std::endian::native == std::endian::little, "packets are little-endian and read in place");

/// Pixels of one row in consecutive columns: where the first one is and how far apart they are.
struct PixelRun {
    const std::byte* first;
    std::size_t stride;
    std::size_t count;
};

template <class T>
inline void extract(const PixelRun& run, const FieldExtraction& field, T* __restrict out) {
    const std::byte* source = run.first + field.byte_offset;
    for (std::size_t i = 0; i < run.count; ++i, source += run.stride) {
        std::uint32_t word;
        std::memcpy(&word, source, sizeof(word));
        out[i] = static_cast<T>(((word >> field.right) & field.mask) << field.left);
    }
}

FieldExtraction extraction(const BitField& field, int pixel_bytes) {
    if (!field.present()) return {};
    // The 32 bits must not reach beyond the pixel: the last one of a packet may be the last thing in memory.
    const int byte = std::min(field.bit_offset / 8, pixel_bytes - 4);
    return {.byte_offset = static_cast<std::uint32_t>(byte),
            .right = static_cast<std::uint32_t>(field.bit_offset - 8 * byte),
            .mask = (std::uint32_t{1} << field.bits) - 1,
            .left = field.shift};
}

}  // namespace

PixelDecoder::PixelDecoder(const PacketLayout& layout, const SensorModel& sensor)
    : layout_(layout), width_(sensor.width) {
    for (const int shift : sensor.pixel_shift) shift_.push_back(((shift % width_) + width_) % width_);
    const PacketFormat& format = layout.format();
    range_ = extraction(format.field(PixelField::kRange), format.pixel_bytes);
    reflectivity_ = extraction(format.field(PixelField::kReflectivity), format.pixel_bytes);
    signal_ = extraction(format.field(PixelField::kSignal), format.pixel_bytes);
    near_ir_ = extraction(format.field(PixelField::kNearIr), format.pixel_bytes);
}

void PixelDecoder::decode(std::span<const std::byte> packet, int first_column, int count, int first_measurement,
                          RawImages& images) const {
    const auto decode_run = [&](int row, int column, int destination, int pixels) {
        const PixelRun run{packet.data() + layout_.pixel_offset(column, row), layout_.column_bytes(),
                           static_cast<std::size_t>(pixels)};
        extract(run, range_, images.range_mm.row(row) + destination);
        extract(run, reflectivity_, images.reflectivity.row(row) + destination);
        if (signal_.mask != 0) extract(run, signal_, images.signal.row(row) + destination);
        extract(run, near_ir_, images.near_ir.row(row) + destination);
    };
    // Rows outside, columns inside: each row's pixels of a packet lie side by side in the destaggered image.
    for (int row = 0; row < layout_.rows(); ++row) {
        int destination = first_measurement + shift_[static_cast<std::size_t>(row)];
        if (destination >= width_) destination -= width_;
        const int before_edge = std::min(count, width_ - destination);
        decode_run(row, first_column, destination, before_edge);
        if (before_edge < count) decode_run(row, first_column + before_edge, 0, count - before_edge);
    }
}

void PixelDecoder::clear(int first_measurement, int count, RawImages& images) const {
    const auto clear_run = [&](int row, int column, int pixels) {
        std::fill_n(images.range_mm.row(row) + column, pixels, std::uint32_t{0});
        std::fill_n(images.reflectivity.row(row) + column, pixels, std::uint8_t{0});
        std::fill_n(images.signal.row(row) + column, pixels, std::uint16_t{0});
        std::fill_n(images.near_ir.row(row) + column, pixels, std::uint16_t{0});
    };
    for (int row = 0; row < layout_.rows(); ++row) {
        int column = first_measurement + shift_[static_cast<std::size_t>(row)];
        if (column >= width_) column -= width_;
        const int before_edge = std::min(count, width_ - column);
        clear_run(row, column, before_edge);
        clear_run(row, 0, count - before_edge);
    }
}

}  // namespace dlod::driver
