#pragma once

namespace dlod::test {

/// Under ThreadSanitizer all is slower by an order of magnitude: a sensor's rate is too much, and times tell nothing.
#ifdef __SANITIZE_THREAD__
inline constexpr bool kTooSlowForTimes = true;
#else
inline constexpr bool kTooSlowForTimes = false;
#endif

}  // namespace dlod::test
