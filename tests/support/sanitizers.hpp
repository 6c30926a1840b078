#pragma once

#include <cstdlib>

namespace dlod::test {

/// Under ThreadSanitizer all is slower by an order of magnitude: a sensor's rate is too much, and times tell nothing.
#ifdef __SANITIZE_THREAD__
inline constexpr bool kTooSlowForTimes = true;
#else
inline constexpr bool kTooSlowForTimes = false;
#endif

/// ThreadSanitizer runs the small forms of the long live tests only where DLOD_TEST_SMALL_FORMS is set.
inline bool leaves_out_small_forms() {
    return kTooSlowForTimes && std::getenv("DLOD_TEST_SMALL_FORMS") == nullptr;
}

}  // namespace dlod::test
