#pragma once

namespace dlod::test {

/// Under ThreadSanitizer all is slower by an order of magnitude, under AddressSanitizer by half of one: a sensor's rate
/// is too much, and times tell nothing.
#if defined(__SANITIZE_THREAD__) || defined(__SANITIZE_ADDRESS__)
inline constexpr bool kTooSlowForTimes = true;
#else
inline constexpr bool kTooSlowForTimes = false;
#endif

}  // namespace dlod::test
