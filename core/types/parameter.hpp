// How a module declares its tunables, once, for the loader, the documentation and the range check alike.
//
// A configuration struct has a member `template <class V> void visit(V& v)` that calls, for each tunable,
//     v.parameter("key", member, Range{low, high}, "unit", "what it does and what raising it changes");
// and for each nested struct
//     v.group("key", member, "what it is about");
// Booleans and enumerations (strings) have overloads without a range: v.flag(key, member, effect) and
// v.choice(key, member, {"a", "b"}, effect) with an int member that is the index.
// Core does not know YAML: daemon/config implements the visitors.
#pragma once

namespace dlod {

/// Inclusive bounds of a tunable.
struct Range {
    double low = 0.0;
    double high = 0.0;
};

}  // namespace dlod
