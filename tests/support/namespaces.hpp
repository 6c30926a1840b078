// Parts of the system that a test has for itself.
#pragma once

#include <sched.h>
#include <unistd.h>

#include <fstream>

namespace dlod::test {

/// Moves this process into namespaces of its own (CLONE_NEWNET, CLONE_NEWNS); without the right to that, as the root of
/// a user namespace. @return false where the system does not allow it; nothing has changed then
inline bool enter_namespaces(int flags) {
    if (::unshare(flags) == 0) return true;
    const uid_t user = ::geteuid();
    const gid_t group = ::getegid();
    if (::unshare(CLONE_NEWUSER | flags) != 0) return false;
    std::ofstream("/proc/self/setgroups") << "deny";
    std::ofstream("/proc/self/uid_map") << "0 " << user << " 1";
    std::ofstream("/proc/self/gid_map") << "0 " << group << " 1";
    return true;
}

}  // namespace dlod::test
