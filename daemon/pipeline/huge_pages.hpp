#pragma once

namespace dlod::daemon {

/// Frames, maps and images come to some hundred megabytes that every turn walks through, in strides that miss the
/// processor's table of small pages. Lets the heap consist of huge pages where the system has them on request
/// ("madvise") and take in the large blocks, too. To be called once, before they are allocated; without effect
/// elsewhere.
void prefer_huge_pages();

}  // namespace dlod::daemon
