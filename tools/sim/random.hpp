// Random numbers that depend on the seed and on what they are for, never on the order in which threads draw them.
#pragma once

#include <cmath>
#include <cstdint>
#include <numbers>

namespace dlod::tools::sim {

/// Scrambles 64 bits (finaliser of splitmix64).
constexpr std::uint64_t mix_bits(std::uint64_t x) {
    x += 0x9E3779B97F4A7C15ULL;
    x = (x ^ (x >> 30)) * 0xBF58476D1CE4E5B9ULL;
    x = (x ^ (x >> 27)) * 0x94D049BB133111EBULL;
    return x ^ (x >> 31);
}

/// A stream of random numbers, cheap enough to be made for a single pixel.
class Random {
  public:
    explicit Random(std::uint64_t seed, std::uint64_t stream = 0, std::uint64_t index = 0)
        : state_(mix_bits(mix_bits(mix_bits(seed) ^ stream) ^ index)) {}

    std::uint64_t bits() {
        state_ += 0x9E3779B97F4A7C15ULL;
        return mix_bits(state_);
    }
    /// In [0, 1).
    double uniform() { return static_cast<double>(bits() >> 11) * 0x1.0p-53; }
    double uniform(double low, double high) { return low + (high - low) * uniform(); }
    /// In low .. high, both included.
    int integer(int low, int high) {
        return low + static_cast<int>(bits() % static_cast<std::uint64_t>(high - low + 1));
    }
    bool chance(double probability) { return uniform() < probability; }
    double sign() { return chance(0.5) ? 1.0 : -1.0; }
    /// Of mean 0 and deviation 1 (Box and Muller).
    double normal() {
        const double radius = std::sqrt(-2.0 * std::log(1.0 - uniform()));
        return radius * std::cos(2.0 * std::numbers::pi * uniform());
    }

  private:
    std::uint64_t state_;
};

}  // namespace dlod::tools::sim
