#include "driver/ip_reassembly.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>
#include <string>

#include "tests/support/network_bytes.hpp"

namespace dlod::driver {
namespace {

using test::ByteVector;
using test::payload_pattern;

constexpr std::int64_t kMillisecond = 1'000'000;

class IpReassemblyTest : public testing::Test {
  protected:
    /// The datagram that this fragment completes, or nothing.
    ByteVector add(const ByteVector& ip_packet, std::int64_t time_ns = 0, std::uint32_t vlan = 0) {
        const IpPacket p = parse_ip(ip_packet);
        EXPECT_EQ(p.fault, IpFault::kNone);
        const Bytes whole = reassembly_.add(p, vlan, time_ns);
        return {whole.begin(), whole.end()};
    }

    /// All of them; the last datagram completed.
    ByteVector add_all(const std::vector<ByteVector>& packets, std::int64_t time_ns = 0) {
        ByteVector last;
        for (const ByteVector& p : packets) {
            if (ByteVector whole = add(p, time_ns); !whole.empty()) last.swap(whole);
        }
        return last;
    }

    const ReassemblyCounters& counters() const { return reassembly_.counters(); }

    IpReassembly reassembly_;
};

TEST_F(IpReassemblyTest, AnyOrderOfFragments) {
    std::mt19937 random(1);
    for (const bool ipv6 : {false, true}) {
        for (std::uint32_t i = 0; i < 200; ++i) {
            const ByteVector datagram = test::udp(payload_pattern(8448 + i % 24, i), {.ipv6 = ipv6});
            auto fragments = test::ip_fragments(datagram, {.ipv6 = ipv6, .id = i});
            std::shuffle(fragments.begin(), fragments.end(), random);
            for (std::size_t n = 0; n + 1 < fragments.size(); ++n) EXPECT_TRUE(add(fragments[n]).empty());
            EXPECT_EQ(add(fragments.back()), datagram);
        }
    }
    EXPECT_EQ(counters().reassembled.value(), 400U);
    EXPECT_EQ(counters().overlapping.value(), 0U);
    EXPECT_EQ(counters().timed_out.value(), 0U);
}

TEST_F(IpReassemblyTest, DuplicatesAreIgnoredBeforeAndAfterCompletion) {
    const ByteVector datagram = payload_pattern(5000, 1);
    const auto fragments = test::ip_fragments(datagram, {.id = 9});
    add(fragments[0]);
    EXPECT_TRUE(add(fragments[0]).empty());
    add(fragments[3]);
    EXPECT_TRUE(add(fragments[3]).empty());
    add(fragments[1]);
    EXPECT_EQ(add(fragments[2]), datagram);
    for (const ByteVector& f : fragments) EXPECT_TRUE(add(f, kMillisecond).empty());
    EXPECT_EQ(counters().duplicate_fragments.value(), 6U);
    EXPECT_EQ(counters().reassembled.value(), 1U);
    reassembly_.finish();
    EXPECT_EQ(counters().timed_out.value(), 0U);
}

TEST_F(IpReassemblyTest, TheSameIdAgainAfterCompletionIsANewDatagram) {
    for (std::uint32_t i = 0; i < 10; ++i) {
        const ByteVector datagram = payload_pattern(5000, i);
        EXPECT_EQ(add_all(test::ip_fragments(datagram, {.id = 0})), datagram);
    }
    EXPECT_EQ(counters().reassembled.value(), 10U);
}

TEST_F(IpReassemblyTest, InterleavedDatagramsKeepApart) {
    // One differs from the other in a single part of the key.
    const ByteVector a = payload_pattern(5000, 1);
    const ByteVector b = payload_pattern(5000, 2);
    const auto first = test::ip_fragments(a, {.id = 5});
    const std::vector<test::IpFields> others{{.source = 8, .id = 5},
                                             {.destination = 2, .id = 5},
                                             {.protocol = 6, .id = 5},
                                             {.id = 6},
                                             {.ipv6 = true, .id = 5}};
    for (std::size_t k = 0; k < others.size(); ++k) {
        const auto second = test::ip_fragments(b, others[k]);
        const std::int64_t t = 10'000 * kMillisecond * static_cast<std::int64_t>(k);
        for (std::size_t i = 0; i + 1 < first.size(); ++i) {
            add(first[i], t);
            add(second[i], t);
        }
        EXPECT_EQ(add(first.back(), t), a) << k;
        EXPECT_EQ(add(second.back(), t), b) << k;
    }
    const std::int64_t t = 100'000 * kMillisecond;
    for (std::size_t i = 0; i + 1 < first.size(); ++i) {
        add(first[i], t, 1);
        add(test::ip_fragments(b, {.id = 5})[i], t, 2);
    }
    EXPECT_EQ(add(first.back(), t, 1), a);
}

TEST_F(IpReassemblyTest, AnIdUsedAgainBeforeCompletionIsGoodAgainFromTheNextFirstFragment) {
    // A sender with one id for everything, and one fragment lost: each one in turn.
    for (std::size_t lost = 0; lost < 4; ++lost) {
        SCOPED_TRACE(lost);
        const std::uint32_t id = static_cast<std::uint32_t>(lost);
        std::set<std::uint32_t> whole;
        for (std::uint32_t i = 0; i < 6; ++i) {
            const std::int64_t time_ns = i * kMillisecond;
            const auto fragments = test::ip_fragments(payload_pattern(5000, i), {.id = id});
            const std::string datagram = test::key_of(payload_pattern(5000, i));
            for (std::size_t k = 0; k < fragments.size(); ++k) {
                if (i == 1 && k == lost) continue;
                const std::string got = test::key_of(add(fragments[k], time_ns));
                if (got == datagram) whole.insert(i);
                // As the caller's checks find it.
                if (!got.empty() && got != datagram) reassembly_.refuse(time_ns);
            }
        }
        // All but the damaged one, and the next where nothing tells that its first fragment begins another.
        const std::set<std::uint32_t> expected =
            lost == 0 ? std::set<std::uint32_t>{0, 3, 4, 5} : std::set<std::uint32_t>{0, 2, 3, 4, 5};
        EXPECT_EQ(whole, expected);
    }
    reassembly_.finish();
    EXPECT_EQ(counters().timed_out.value(), 0U);
}

TEST_F(IpReassemblyTest, AfterAContradictionOnlyFragmentsInOrderAndWithoutAGapCount) {
    const auto a = test::ip_fragments(payload_pattern(5000, 1), {.id = 5});
    const auto b = test::ip_fragments(payload_pattern(5000, 2), {.id = 5});
    const auto c = test::ip_fragments(payload_pattern(5000, 3), {.id = 5});
    add(a[0]);
    add(b[0]);  // contradicts, and begins anew
    EXPECT_EQ(counters().overlapping.value(), 1U);
    EXPECT_TRUE(add(b[2]).empty());  // its second one is late or lost; this one may be a's
    EXPECT_TRUE(add(b[1]).empty());
    EXPECT_TRUE(add(b[3]).empty());
    EXPECT_EQ(counters().overlapping.value(), 2U);
    EXPECT_EQ(counters().rejected_fragments.value(), 2U);
    EXPECT_EQ(add_all(c), payload_pattern(5000, 3));
    EXPECT_TRUE(reassembly_.contested());
    // Later than the timeout they may come in any order again.
    const std::int64_t t = 3000 * kMillisecond;
    add(b[3], t);
    add(b[0], t);
    add(b[2], t);
    EXPECT_EQ(add(b[1], t), payload_pattern(5000, 2));
    EXPECT_FALSE(reassembly_.contested());
    EXPECT_EQ(counters().timed_out.value(), 0U);
}

TEST_F(IpReassemblyTest, PartialOverlapsCondemnTheDatagram) {
    const ByteVector datagram = payload_pattern(4000, 1);
    const auto fine = test::ip_fragments(datagram, {.id = 5}, 1000);
    const auto shifted = test::ip_fragments(datagram, {.id = 5}, 1008);
    add(fine[0]);
    EXPECT_TRUE(add(shifted[0]).empty());  // the same bytes and more: an overlap all the same
    for (std::size_t i = 1; i < fine.size(); ++i) EXPECT_TRUE(add(fine[i]).empty());
    EXPECT_EQ(counters().overlapping.value(), 2U);  // shifted[0] might have begun a new one, but fine[1] overlaps it

    const auto later = test::ip_fragments(datagram, {.id = 6}, 1008);
    add(later[1]);
    EXPECT_TRUE(add(test::ip_fragments(datagram, {.id = 6}, 1000)[1]).empty());
    EXPECT_EQ(counters().overlapping.value(), 3U);
}

TEST_F(IpReassemblyTest, LengthsThatContradictCondemnTheDatagram) {
    const auto longer = test::ip_fragments(payload_pattern(5000, 1), {.id = 5});
    const auto shorter = test::ip_fragments(payload_pattern(2000, 1), {.id = 5});
    add(longer[3]);
    EXPECT_TRUE(add(shorter[1]).empty());  // a second end
    EXPECT_EQ(counters().overlapping.value(), 1U);

    const auto longer6 = test::ip_fragments(payload_pattern(5000, 1), {.id = 6});
    const auto shorter6 = test::ip_fragments(payload_pattern(2000, 1), {.id = 6});
    add(shorter6[1]);
    EXPECT_TRUE(add(longer6[2]).empty());  // beyond the end
    EXPECT_EQ(counters().overlapping.value(), 2U);

    const auto longer7 = test::ip_fragments(payload_pattern(5000, 1), {.id = 7});
    const auto shorter7 = test::ip_fragments(payload_pattern(2000, 1), {.id = 7});
    add(longer7[2]);
    EXPECT_TRUE(add(shorter7[1]).empty());  // an end before what is there
    EXPECT_EQ(counters().overlapping.value(), 3U);
}

TEST_F(IpReassemblyTest, TimesOutInCaptureTime) {
    const ByteVector datagram = payload_pattern(5000, 1);
    const auto fragments = test::ip_fragments(datagram, {.id = 5});
    add(fragments[0], 0);
    // The old first fragment is gone when its id comes round.
    EXPECT_EQ(add_all(fragments, 88'000 * kMillisecond), datagram);
    EXPECT_EQ(counters().timed_out.value(), 1U);
    // A clock set back counts as a timeout too.
    add(fragments[0], 200'000 * kMillisecond);
    EXPECT_EQ(add_all(fragments, 100'000 * kMillisecond), datagram);
    EXPECT_EQ(counters().timed_out.value(), 2U);
}

TEST_F(IpReassemblyTest, TimesOutByFragmentsWhereTimeStandsStill) {
    const auto old = test::ip_fragments(payload_pattern(2000, 1), {.id = 5});
    add(old[0]);
    for (std::uint32_t i = 6; i < 6 + 20'000; ++i) add_all(test::ip_fragments(payload_pattern(2000, i), {.id = i}));
    const auto fresh = test::ip_fragments(payload_pattern(2000, 2), {.id = 5});
    EXPECT_TRUE(add(fresh[1]).empty());
    EXPECT_EQ(counters().timed_out.value(), 1U);
    EXPECT_EQ(counters().reassembled.value(), 20'000U);
}

TEST_F(IpReassemblyTest, IsBoundedInNumber) {
    for (std::uint32_t i = 0; i < 1000; ++i) add(test::ip_fragments(payload_pattern(5000, i), {.id = i})[0]);
    EXPECT_EQ(counters().evicted.value(), 1000U - 64U);
    // The newest are still there.
    const auto last = test::ip_fragments(payload_pattern(5000, 999), {.id = 999});
    add(last[1]);
    add(last[2]);
    EXPECT_EQ(add(last[3]), payload_pattern(5000, 999));
    reassembly_.finish();
    EXPECT_EQ(counters().timed_out.value(), 63U);
}

TEST_F(IpReassemblyTest, IsBoundedInFragments) {
    const auto tiny = test::ip_fragments(payload_pattern(8 * 600, 1), {.id = 1}, 8);
    EXPECT_TRUE(add_all(tiny).empty());
    EXPECT_EQ(counters().evicted.value(), 1U);
    EXPECT_EQ(counters().rejected_fragments.value(), 600U - 513U);
}

TEST_F(IpReassemblyTest, ImpossibleFragmentsAreMalformed) {
    EXPECT_TRUE(add(test::ip(payload_pattern(1001, 1), {.more = true})).empty());     // not in steps of 8
    EXPECT_TRUE(add(test::ip(payload_pattern(1480, 1), {.offset = 65528})).empty());  // beyond 64 KiB
    EXPECT_TRUE(add(test::ip({}, {.offset = 800})).empty());                          // nothing
    EXPECT_EQ(counters().malformed.value(), 3U);
}

/// Fragments of 100 datagrams on their way: lost, duplicated, shuffled within a window.
struct Traffic {
    struct Wire {
        std::int64_t time_ns;
        ByteVector packet;
    };
    std::vector<Wire> wire;
    std::set<std::string> sent;
};

/// `id_count` ids are used in turn, a millisecond apart; every fragment arrives within `spread_ns`.
Traffic traffic(std::mt19937& random, std::uint32_t first, std::uint32_t id_count, std::int64_t spread_ns,
                test::Checksum checksum) {
    const auto below = [&](std::uint32_t n) { return static_cast<std::uint32_t>(random() % n); };
    Traffic t;
    const std::uint32_t loss = below(30);
    for (std::uint32_t i = 0; i < 100; ++i) {
        const bool ipv6 = i / id_count % 2 == 1;
        const ByteVector datagram =
            test::udp(payload_pattern(2000 + 8 * below(3), first + i), {.ipv6 = ipv6, .checksum = checksum});
        t.sent.insert(test::key_of(datagram));
        const std::int64_t time_ns = i * kMillisecond;
        for (auto& f : test::ip_fragments(datagram, {.ipv6 = ipv6, .id = i % id_count}, 504)) {
            if (below(100) < loss) continue;
            const auto late = [&] {
                return static_cast<std::int64_t>(random() % static_cast<std::uint64_t>(spread_ns));
            };
            if (below(20) == 0) t.wire.push_back({time_ns + late(), f});
            t.wire.push_back({time_ns + late(), std::move(f)});
        }
    }
    std::stable_sort(t.wire.begin(), t.wire.end(),
                     [](const Traffic::Wire& x, const Traffic::Wire& y) { return x.time_ns < y.time_ns; });
    return t;
}

constexpr int kPacketsARound = 500;

/// Ids come round after the timeout, as a sensor's do: no datagram is ever made of two, with no checksum to help.
TEST(IpReassemblyFuzz, NothingMixesWhereIdsOutliveTheTimeout) {
    const int rounds = test::fuzz_packets(30'000) / kPacketsARound;
    std::mt19937 random(42);
    std::uint64_t delivered = 0;
    for (int round = 0; round < rounds; ++round) {
        IpReassembly reassembly({.datagrams = 16, .timeout_ns = 10 * kMillisecond});
        const Traffic t =
            traffic(random, 100U * static_cast<std::uint32_t>(round), 20, 9 * kMillisecond, test::Checksum::kNone);
        for (const auto& w : t.wire) {
            const Bytes whole = reassembly.add(parse_ip(w.packet), 0, w.time_ns);
            if (whole.empty()) continue;
            ++delivered;
            ASSERT_TRUE(t.sent.contains(test::key_of({whole.begin(), whole.end()}))) << "round " << round;
        }
    }
    EXPECT_EQ(delivered > 0, rounds > 0);
}

/// Ids come round at once, which no sender does: the contradictions between fragments and UDP's checks catch what they
/// can, and 16 bits of checksum let one in 65,536 of the rest pass.
TEST(IpReassemblyFuzz, ChecksCatchMixturesWhereIdsAreUsedAtOnceAgain) {
    const int rounds = test::fuzz_packets(30'000) / kPacketsARound;
    std::mt19937 random(43);
    std::uint64_t delivered = 0;
    std::uint64_t caught = 0;
    std::uint64_t passed = 0;
    for (int round = 0; round < rounds; ++round) {
        IpReassembly reassembly({.datagrams = 16});
        const Traffic t =
            traffic(random, 100U * static_cast<std::uint32_t>(round), 6, 30 * kMillisecond, test::Checksum::kRight);
        for (const auto& w : t.wire) {
            const IpPacket p = parse_ip(w.packet);
            const Bytes whole = reassembly.add(p, 0, w.time_ns);
            if (whole.empty()) continue;
            const auto udp = parse_udp(p.source, p.destination, whole);
            if (!udp || udp->length != whole.size() || udp->checksum != UdpChecksum::kRight) {
                ++caught;
            } else {
                ++delivered;
                passed += t.sent.contains(test::key_of({whole.begin(), whole.end()})) ? 0 : 1;
            }
        }
        const auto& c = reassembly.counters();
        EXPECT_EQ(c.fragments.value(), t.wire.size());
    }
    EXPECT_EQ(delivered > 0, rounds > 0);
    EXPECT_EQ(caught > 0, rounds > 0);
    // Four times what chance gives, and room for one where hardly any is expected.
    EXPECT_LE(passed, 1 + 4 * caught / 65'536) << "of " << caught;
}

}  // namespace
}  // namespace dlod::driver
