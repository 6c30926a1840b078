#include "core/segmentation/row_links.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

#include "core/types/multiversion.hpp"

#ifdef __SSE2__
#include <emmintrin.h>
#endif

namespace dlod {
namespace {

constexpr std::size_t kWord = 64;
constexpr std::uint8_t kYes = 0xFF;

inline float lesser(float a, float b) {
    return a < b ? a : b;
}

inline float greater(float a, float b) {
    return a < b ? b : a;
}

inline bool is_linked(float near, float far, float ratio, float max_step) {
    return (near > 0.0F) & (far <= ratio * near) & (far - near <= max_step);
}

/// One row of ranges with a border of one at its end. (GCC vectorises the loop only with near and far taken here.)
DLOD_MULTIVERSION_512 void link_row(int width, const float* __restrict ranges, const float* __restrict ranges_above,
                                    float ratio_right, float ratio_down, float max_step, std::uint8_t* __restrict used,
                                    std::uint8_t* __restrict to_right, std::uint8_t* __restrict to_above) {
    for (int c = 0; c < width; ++c) {
        const float here = ranges[c];
        const float right = ranges[c + 1];
        const float above = ranges_above[c];
        const float near_right = lesser(here, right), far_right = greater(here, right);
        const float near_above = lesser(here, above), far_above = greater(here, above);
        used[c] = here > 0.0F ? kYes : 0;
        to_right[c] = is_linked(near_right, far_right, ratio_right, max_step) ? kYes : 0;
        to_above[c] = is_linked(near_above, far_above, ratio_down, max_step) ? kYes : 0;
    }
}

/// 64 bytes of 0 or kYes as bits, the first one lowest.
std::uint64_t pack_word(const std::uint8_t* bytes) {
    std::uint64_t word = 0;
#ifdef __SSE2__
    for (std::size_t i = 0; i < kWord; i += 16) {
        const __m128i sixteen = _mm_load_si128(reinterpret_cast<const __m128i*>(bytes + i));
        word |= static_cast<std::uint64_t>(static_cast<unsigned>(_mm_movemask_epi8(sixteen))) << i;
    }
#else
    static_assert(std::endian::native == std::endian::little);
    for (std::size_t i = 0; i < kWord; i += 8) {
        std::uint64_t eight = 0;
        std::memcpy(&eight, bytes + i, 8);
        // Byte k's lowest bit is multiplied to bit 56 + k; all other products fall outside of the top byte.
        word |= ((eight & 0x0101010101010101U) * 0x0102040810204080U >> 56U) << i;
    }
#endif
    return word;
}

}  // namespace

RowLinks::RowLinks(int width) : width_(width) {
    const std::size_t words = (static_cast<std::size_t>(width) + kWord - 1) / kWord;
    for (auto& row : rows_) row.assign(kBorder + static_cast<std::size_t>(width) + 1, 0.0F);
    for (auto* v : {&begins_[0], &begins_[1], &ends_, &joins_}) v->assign(words, 0);
    for (auto* v : {&used_, &to_right_, &to_above_}) v->assign(words * kWord, 0);
}

void RowLinks::begin() {
    std::fill(rows_[current_].begin(), rows_[current_].end(), 0.0F);
    std::fill(begins_[current_].begin(), begins_[current_].end(), 0);
}

void RowLinks::advance(float ratio_right, float ratio_down, float max_step_m) {
    const float* above = rows_[current_].data() + kBorder;
    current_ ^= 1;
    const float* here = rows_[current_].data() + kBorder;
    link_row(width_, here, above, ratio_right, ratio_down, max_step_m, used_.data(), to_right_.data(),
             to_above_.data());
    const auto [near, far] = std::minmax(here[0], here[width_ - 1]);
    wraps_ = is_linked(near, far, ratio_right, max_step_m);
    std::vector<std::uint64_t>& begins = begins_[current_];
    std::uint64_t right_of_last = 0;  // bits that the word before hands on: its last column's
    std::uint64_t above_of_last = 0;
    for (std::size_t w = 0; w < begins.size(); ++w) {
        const std::uint64_t used = pack_word(&used_[w * kWord]);
        const std::uint64_t to_right = pack_word(&to_right_[w * kWord]);
        const std::uint64_t to_above = pack_word(&to_above_[w * kWord]);
        begins[w] = used & ~(to_right << 1U | right_of_last);
        ends_[w] = used & ~to_right;
        // Two runs touch in stretches of columns: enough to know the first column of each stretch.
        joins_[w] = to_above & (begins[w] | begins_above()[w] | ~(to_above << 1U | above_of_last));
        right_of_last = to_right >> (kWord - 1);
        above_of_last = to_above >> (kWord - 1);
    }
}

}  // namespace dlod
