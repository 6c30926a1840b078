#include "driver/pixel_decoder.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "core/types/multiversion.hpp"

namespace dlod::driver {
namespace {

static_assert(std::endian::native == std::endian::little, "packets are little-endian and read in place");

constexpr int kBlock = 16;  // columns of most packets

/// One block of pixels of a row: columns side by side in the images, `column_stride` bytes apart in the packet.
struct Block {
    const std::byte* pixels;
    std::size_t column_stride;
    FieldCut range, reflectivity, signal, near_ir;
    std::uint32_t* range_out;
    std::uint8_t* reflectivity_out;
    std::uint16_t* signal_out;
    std::uint16_t* near_ir_out;
};

/// Words of a pixel that hold the fields are gathered once; the cutting then works on whole vectors.
inline __attribute__((always_inline)) void decode_block(const Block& block, const int count) {
    std::uint32_t words[kBlock];
    int gathered = -1;
    const auto cut = [&](const FieldCut& field, auto* __restrict out) {
        if (field.mask == 0) return;
        if (field.word != gathered) {
            const std::byte* source = block.pixels + 4 * field.word;
            for (int i = 0; i < count; ++i, source += block.column_stride) std::memcpy(&words[i], source, 4);
            gathered = field.word;
        }
        const FieldCut f = field;
        for (int i = 0; i < count; ++i) {
            out[i] = static_cast<std::remove_reference_t<decltype(*out)>>(((words[i] >> f.right) & f.mask) << f.left);
        }
    };
    cut(block.range, block.range_out);
    cut(block.reflectivity, block.reflectivity_out);
    cut(block.signal, block.signal_out);
    cut(block.near_ir, block.near_ir_out);
}

DLOD_MULTIVERSION
void decode_full_block(const Block& block) {
    decode_block(block, kBlock);
}

DLOD_MULTIVERSION
void decode_part_of_block(const Block& block, int count) {
    decode_block(block, count);
}

FieldCut cut_of(const BitField& field) {
    if (!field.present()) return {};
    return {.word = field.bit_offset / 32,
            .right = static_cast<std::uint32_t>(field.bit_offset % 32),
            .mask = (std::uint32_t{1} << field.bits) - 1,
            .left = field.shift};
}

}  // namespace

PixelDecoder::PixelDecoder(const PacketLayout& layout, const SensorModel& sensor)
    : layout_(layout), width_(sensor.width) {
    for (const int shift : sensor.pixel_shift) shift_.push_back(((shift % width_) + width_) % width_);
    const PacketFormat& format = layout.format();
    range_ = cut_of(format.field(PixelField::kRange));
    reflectivity_ = cut_of(format.field(PixelField::kReflectivity));
    signal_ = cut_of(format.field(PixelField::kSignal));
    near_ir_ = cut_of(format.field(PixelField::kNearIr));
}

void PixelDecoder::decode(std::span<const std::byte> packet, int first_column, int count, int first_measurement,
                          RawImages& images) const {
    Block block{.pixels = nullptr,
                .column_stride = layout_.column_bytes(),
                .range = range_,
                .reflectivity = reflectivity_,
                .signal = signal_,
                .near_ir = near_ir_,
                .range_out = nullptr,
                .reflectivity_out = nullptr,
                .signal_out = nullptr,
                .near_ir_out = nullptr};
    // Rows outside, columns inside: each row's pixels of a packet lie side by side in the destaggered image.
    for (int row = 0; row < layout_.rows(); ++row) {
        int destination = first_measurement + shift_[static_cast<std::size_t>(row)];
        if (destination >= width_) destination -= width_;
        for (int done = 0; done < count;) {
            const int pixels = std::min({count - done, kBlock, width_ - destination});
            block.pixels = packet.data() + layout_.pixel_offset(first_column + done, row);
            block.range_out = images.range_mm.row(row) + destination;
            block.reflectivity_out = images.reflectivity.row(row) + destination;
            block.signal_out = images.signal.row(row) + destination;
            block.near_ir_out = images.near_ir.row(row) + destination;
            if (pixels == kBlock) {
                decode_full_block(block);
            } else {
                decode_part_of_block(block, pixels);
            }
            done += pixels;
            destination = destination + pixels == width_ ? 0 : destination + pixels;
        }
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
