#include "daemon/recorder/recording_source.hpp"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include "driver/pcap_source.hpp"
#include "tests/support/network_bytes.hpp"

namespace dlod::daemon {
namespace {

using test::ByteVector;
using test::payload_pattern;
using test::ScratchFolder;

constexpr std::int64_t kStart_ns = 1'700'000'000'000'000'000;
constexpr std::uint32_t kPayloads = 16;

/// Batches of three packets, `count` in all.
class Packets final : public driver::PacketSource {
  public:
    explicit Packets(std::uint32_t count) : count_(count) {
        for (std::uint32_t i = 0; i < kPayloads; ++i) data_[i] = payload_pattern(8448, i);
    }
    driver::PacketBatch next() override {
        if (next_ >= count_) return {.status = driver::SourceStatus::kEnd, .packets = {}};
        packets_.clear();
        for (; packets_.size() < 3 && next_ < count_; ++next_) {
            packets_.push_back({.data = data_[next_ % kPayloads],
                                .receive_ns = kStart_ns + next_,
                                .sender_address = driver::ipv4_address(10, 0, 0, 7),
                                .sender_port = 7000,
                                .destination_port = 7502});
        }
        return {.status = driver::SourceStatus::kPackets, .packets = packets_};
    }
    void stop() noexcept override {}
    void visit_counters(const driver::CounterVisitor& visit) const override { visit("inner", next_); }

  private:
    std::uint32_t count_;
    std::uint32_t next_ = 0;
    std::array<ByteVector, kPayloads> data_;
    std::vector<driver::Packet> packets_;
};

std::map<std::string, std::uint64_t> counters(const driver::PacketSource& source) {
    std::map<std::string, std::uint64_t> all;
    source.visit_counters([&](std::string_view name, std::uint64_t n) { all[std::string(name)] = n; });
    return all;
}

TEST(RecordingSource, TheRecordingIsWhatPassed) {
    const ScratchFolder scratch;
    constexpr std::uint32_t kCount = 1000;
    {
        Packets packets(kCount);
        RecordingSource source(packets, {.folder = scratch.file("r").string()}, "{}");
        std::uint32_t passed = 0;
        for (auto batch = source.next(); batch.status == driver::SourceStatus::kPackets; batch = source.next()) {
            for (const driver::Packet& p : batch.packets) EXPECT_EQ(p.receive_ns, kStart_ns + passed++);
        }
        EXPECT_EQ(passed, kCount);
        EXPECT_TRUE(source.take_warnings().empty());
        EXPECT_EQ(counters(source)["inner"], kCount);
    }
    driver::PcapSource replay(scratch.file("r") / "dlod_000001_20231114T221320Z.pcap");
    for (std::uint32_t i = 0; i < kCount; ++i) {
        const auto batch = replay.next();
        ASSERT_EQ(batch.status, driver::SourceStatus::kPackets);
        const driver::Packet& p = batch.packets[0];
        EXPECT_EQ(ByteVector(p.data.begin(), p.data.end()), payload_pattern(8448, i % kPayloads));
        EXPECT_EQ(p.receive_ns, kStart_ns + i);
        EXPECT_EQ(p.sender_address, driver::ipv4_address(10, 0, 0, 7));
        EXPECT_EQ(p.sender_port, 7000);
        EXPECT_EQ(p.destination_port, 7502);
    }
    EXPECT_EQ(replay.next().status, driver::SourceStatus::kEnd);
}

TEST(RecordingSource, WhatWaitsAtTheEndIsWritten) {
    const ScratchFolder scratch;
    for (int round = 0; round < 20; ++round) {
        {
            Packets packets(3);
            RecordingSource source(packets, {.folder = scratch.file("r").string(), .files = 100}, "");
            source.next();
        }
        int files = 0;
        for (const auto& entry : std::filesystem::directory_iterator(scratch.file("r"))) {
            driver::PcapSource replay(entry.path());
            for (int i = 0; i < 3; ++i) EXPECT_EQ(replay.next().status, driver::SourceStatus::kPackets);
            ++files;
        }
        EXPECT_EQ(files, round + 1);
    }
}

TEST(RecordingSource, AFullBufferCostsTheRecordingNotTheCaller) {
    const ScratchFolder scratch;
    Packets packets(3000);
    RecordingSource source(packets, {.folder = scratch.file("r").string(), .buffer_megabytes = 1}, "{}");
    std::uint32_t passed = 0;
    for (auto batch = source.next(); batch.status == driver::SourceStatus::kPackets; batch = source.next()) {
        passed += static_cast<std::uint32_t>(batch.packets.size());
    }
    EXPECT_EQ(passed, 3000U);
    // 25 MB within less than a few write periods do not fit into 1 MB.
    EXPECT_GT(counters(source)["recording_buffer_full"], 0U);
    const auto warnings = source.take_warnings();
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_NE(warnings[0].find("too slow"), std::string::npos);
}

/// Nobody has plugged in the sensor.
class NoPackets final : public driver::PacketSource {
  public:
    driver::PacketBatch next() override { return {}; }
    void stop() noexcept override {}
    void visit_counters(const driver::CounterVisitor&) const override {}
};

TEST(RecordingSource, AFolderThatCannotBeWrittenIsReportedBeforeAPacketComes) {
    const ScratchFolder scratch;
    scratch.write("blocked", {});
    NoPackets nothing;
    RecordingSource source(nothing, {.folder = scratch.file("blocked").string()}, "{}");
    std::vector<std::string> warnings;
    for (int i = 0; i < 500 && warnings.empty(); ++i) {
        std::this_thread::sleep_for(std::chrono::milliseconds(10));
        source.next();
        warnings = source.take_warnings();
    }
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_NE(warnings[0].find("blocked"), std::string::npos) << warnings[0];
}

TEST(RecordingSource, AFolderThatCannotBeWrittenIsReportedOnce) {
    const ScratchFolder scratch;
    scratch.write("blocked", {});
    Packets packets(600);
    RecordingSource source(packets, {.folder = scratch.file("blocked").string()}, "{}");
    std::vector<std::string> warnings;
    for (auto batch = source.next(); batch.status == driver::SourceStatus::kPackets; batch = source.next()) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        for (auto& w : source.take_warnings()) warnings.push_back(std::move(w));
    }
    ASSERT_EQ(warnings.size(), 1U);
    EXPECT_NE(warnings[0].find("recording: "), std::string::npos);
    EXPECT_NE(warnings[0].find("blocked"), std::string::npos);
    EXPECT_GT(counters(source)["recording_write_failed"], 0U);
}

}  // namespace
}  // namespace dlod::daemon
