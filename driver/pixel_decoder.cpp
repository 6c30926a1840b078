#include "driver/pixel_decoder.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "core/types/multiversion.hpp"

namespace dlod::driver {
namespace {

static_assert(std::endian::native == std::endian::little, "packets are little-endian and read in place");

constexpr std::size_t kTile = 4;     // words of a vector; rows and columns that are turned at once
constexpr std::size_t kTurned = 16;  // columns of most packets

using Tile = std::uint32_t __attribute__((vector_size(4 * kTile)));
using StagedWords = std::uint32_t[PixelDecoder::kStagedColumns];

/// words[i][c]: word i of column c, for kTile words of kTurned columns.
inline __attribute__((always_inline)) void turn_tiles(const std::byte* source, std::size_t column_bytes,
                                                      StagedWords* words, std::size_t first) {
    for (std::size_t c = first; c < first + kTurned; c += kTile, source += kTile * column_bytes) {
        Tile column[kTile];
        for (std::size_t i = 0; i < kTile; ++i) std::memcpy(&column[i], source + i * column_bytes, sizeof(Tile));
        const Tile a = __builtin_shufflevector(column[0], column[1], 0, 4, 1, 5);
        const Tile b = __builtin_shufflevector(column[2], column[3], 0, 4, 1, 5);
        const Tile d = __builtin_shufflevector(column[0], column[1], 2, 6, 3, 7);
        const Tile e = __builtin_shufflevector(column[2], column[3], 2, 6, 3, 7);
        const Tile row[kTile] = {__builtin_shufflevector(a, b, 0, 1, 4, 5), __builtin_shufflevector(a, b, 2, 3, 6, 7),
                                 __builtin_shufflevector(d, e, 0, 1, 4, 5), __builtin_shufflevector(d, e, 2, 3, 6, 7)};
        for (std::size_t i = 0; i < kTile; ++i) std::memcpy(&words[i][c], &row[i], sizeof(Tile));
    }
}

/// words[i][first + c]: word i of column c of `columns`, the first of which is at `pixels`.
DLOD_MULTIVERSION
void turn(const std::byte* pixels, std::size_t column_bytes, std::size_t column_words, std::size_t columns,
          StagedWords* words, std::size_t first) {
    std::size_t i = 0;
    if (columns == kTurned) {
        for (; i + kTile <= column_words; i += kTile) turn_tiles(pixels + 4 * i, column_bytes, words + i, first);
    }
    for (; i < column_words; ++i) {
        for (std::size_t c = 0; c < columns; ++c) {
            std::memcpy(&words[i][first + c], pixels + c * column_bytes + 4 * i, 4);
        }
    }
}

/// Where staged columns go.
struct Destination {
    std::size_t rows, width;
    std::size_t first_measurement, columns;
    const int* shift;  ///< [rows]
    std::size_t pixel_words;
    FieldCut range, reflectivity, signal, near_ir;
    std::uint32_t* range_out;
    std::uint8_t* reflectivity_out;
    std::uint16_t* signal_out;
    std::uint16_t* near_ir_out;
};

template <class T>
inline __attribute__((always_inline)) void cut(const FieldCut& field, const std::uint32_t* __restrict words,
                                               std::size_t count, T* __restrict out) {
    const FieldCut f = field;
    if (f.mask == 0) return;
    for (std::size_t i = 0; i < count; ++i) out[i] = static_cast<T>(((words[i] >> f.right) & f.mask) << f.left);
}

/// `count` pixels of a row, the first of which is the staged column `from` and the image's `pixel`.
inline __attribute__((always_inline)) void cut_run(const Destination& d, const StagedWords* row, std::size_t from,
                                                   std::size_t count, std::size_t pixel) {
    cut(d.range, row[d.range.word] + from, count, d.range_out + pixel);
    cut(d.reflectivity, row[d.reflectivity.word] + from, count, d.reflectivity_out + pixel);
    cut(d.signal, row[d.signal.word] + from, count, d.signal_out + pixel);
    cut(d.near_ir, row[d.near_ir.word] + from, count, d.near_ir_out + pixel);
}

DLOD_MULTIVERSION
void cut_rows(const Destination& d, const StagedWords* words) {
    for (std::size_t r = 0; r < d.rows; ++r, words += d.pixel_words) {
        std::size_t column = d.first_measurement + static_cast<std::size_t>(d.shift[r]);
        if (column >= d.width) column -= d.width;
        const std::size_t first = r * d.width;
        const std::size_t before_edge = std::min(d.columns, d.width - column);
        if (before_edge == PixelDecoder::kStagedColumns) {
            cut_run(d, words, 0, PixelDecoder::kStagedColumns, first + column);
        } else {
            cut_run(d, words, 0, before_edge, first + column);
            cut_run(d, words, before_edge, d.columns - before_edge, first);
        }
    }
}

FieldCut cut_of(const BitField& field) {
    if (!field.present()) return {};
    return {.word = static_cast<std::size_t>(field.bit_offset) / 32,
            .right = static_cast<std::uint32_t>(field.bit_offset % 32),
            .mask = (std::uint32_t{1} << field.bits) - 1,
            .left = field.shift};
}

}  // namespace

PixelDecoder::PixelDecoder(const PacketLayout& layout, const SensorModel& sensor)
    : layout_(layout),
      width_(static_cast<std::size_t>(sensor.width)),
      pixel_words_(static_cast<std::size_t>(layout.format().pixel_bytes) / 4),
      column_words_(static_cast<std::size_t>(layout.rows()) * pixel_words_) {
    for (const int shift : sensor.pixel_shift) shift_.push_back(((shift % sensor.width) + sensor.width) % sensor.width);
    const PacketFormat& format = layout.format();
    range_ = cut_of(format.field(PixelField::kRange));
    reflectivity_ = cut_of(format.field(PixelField::kReflectivity));
    signal_ = cut_of(format.field(PixelField::kSignal));
    near_ir_ = cut_of(format.field(PixelField::kNearIr));
    words_.resize(column_words_ * kStagedColumns);
}

void PixelDecoder::decode(std::span<const std::byte> packet, int first_column, int count, int first_measurement,
                          RawImages& images) {
    auto measurement = static_cast<std::size_t>(first_measurement);
    if (&images != images_ || measurement != first_staged_ + staged_) flush();
    images_ = &images;
    auto* const words = reinterpret_cast<StagedWords*>(words_.data());
    for (int column = first_column, last = first_column + count; column < last;) {
        if (staged_ == 0) first_staged_ = measurement;
        const std::size_t columns =
            std::min({kTurned, kStagedColumns - staged_, static_cast<std::size_t>(last - column)});
        turn(packet.data() + layout_.pixel_offset(column, 0), layout_.column_bytes(), column_words_, columns, words,
             staged_);
        staged_ += columns;
        measurement += columns;
        column += static_cast<int>(columns);
        if (staged_ == kStagedColumns) flush();
    }
}

void PixelDecoder::flush() {
    if (staged_ == 0) return;
    const Destination destination{.rows = shift_.size(),
                                  .width = width_,
                                  .first_measurement = first_staged_,
                                  .columns = staged_,
                                  .shift = shift_.data(),
                                  .pixel_words = pixel_words_,
                                  .range = range_,
                                  .reflectivity = reflectivity_,
                                  .signal = signal_,
                                  .near_ir = near_ir_,
                                  .range_out = images_->range_mm.data(),
                                  .reflectivity_out = images_->reflectivity.data(),
                                  .signal_out = images_->signal.data(),
                                  .near_ir_out = images_->near_ir.data()};
    cut_rows(destination, reinterpret_cast<const StagedWords*>(words_.data()));
    staged_ = 0;
}

void PixelDecoder::clear(int first_measurement, int count, RawImages& images) const {
    const auto clear_run = [&](int row, int column, int pixels) {
        std::fill_n(images.range_mm.row(row) + column, pixels, std::uint32_t{0});
        std::fill_n(images.reflectivity.row(row) + column, pixels, std::uint8_t{0});
        std::fill_n(images.signal.row(row) + column, pixels, std::uint16_t{0});
        std::fill_n(images.near_ir.row(row) + column, pixels, std::uint16_t{0});
    };
    const auto width = static_cast<int>(width_);
    for (int row = 0; row < layout_.rows(); ++row) {
        int column = first_measurement + shift_[static_cast<std::size_t>(row)];
        if (column >= width) column -= width;
        const int before_edge = std::min(count, width - column);
        clear_run(row, column, before_edge);
        clear_run(row, 0, count - before_edge);
    }
}

}  // namespace dlod::driver
