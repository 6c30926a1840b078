#include "daemon/control/command_handler.hpp"

#include <gtest/gtest.h>

#include <dlod/pose_t.hpp>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "daemon/control/command_decoder.hpp"

namespace dlod::daemon {
namespace {

using Bytes = std::vector<std::byte>;

command_t save_map(std::int64_t id, const std::string& name) {
    command_t command{};
    command.utime = 1000 + id;
    command.id = id;
    command.command = command_t::SAVE_MAP;
    command.argument = name;
    return command;
}

template <class Message>
Bytes encoded(const Message& message) {
    Bytes bytes(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
    return bytes;
}

TEST(CommandDecoder, TakesWhatLcmHasEncoded) {
    for (const std::string& argument : {std::string(), std::string("hall"), std::string(kLongestArgument, 'x')}) {
        const auto decoded = decode_command(encoded(save_map(7, argument)));
        ASSERT_TRUE(decoded.has_value()) << argument;
        EXPECT_EQ(decoded->id, 7);
        EXPECT_EQ(decoded->utime, 1007);
        EXPECT_EQ(decoded->command, command_t::SAVE_MAP);
        EXPECT_EQ(decoded->argument, argument);
    }
}

TEST(CommandDecoder, RefusesWhatIsNoCommand) {
    const Bytes good = encoded(save_map(7, "hall"));
    for (std::size_t size = 0; size < good.size(); ++size) {
        EXPECT_FALSE(decode_command(std::span(good).first(size))) << "cut to " << size;
    }
    Bytes longer = good;
    longer.push_back(std::byte{0});
    EXPECT_FALSE(decode_command(longer));
    EXPECT_FALSE(decode_command(encoded(pose_t{}))) << "of another type";
    Bytes other_version = good;
    other_version[3] ^= std::byte{1};
    EXPECT_FALSE(decode_command(other_version));
    EXPECT_FALSE(decode_command(encoded(save_map(7, std::string(kLongestArgument + 1, 'x')))));
    EXPECT_FALSE(decode_command(encoded(save_map(7, std::string("a\0b", 3)))));
    Bytes endless = good;
    endless.back() = std::byte{'x'};
    EXPECT_FALSE(decode_command(endless)) << "no zero at the end";
    // Lengths that the bytes behind them do not bear out: zero, negative, huge.
    for (const std::uint32_t length : {0U, 1U, 4U, 6U, 0x7FFFFFFFU, 0x80000000U, 0xFFFFFFFFU}) {
        Bytes lying = good;
        for (unsigned i = 0; i < 4; ++i) lying[25 + i] = static_cast<std::byte>(length >> (24 - 8 * i));
        EXPECT_FALSE(decode_command(lying)) << length;
    }
}

class CommandHandlerTest : public testing::Test {
  protected:
    CommandHandlerTest()
        : handler_({.save_map =
                        [this](const std::string& name) {
                            saved_.push_back(name);
                            return CommandAnswer{0, name != "bad", "map " + name};
                        },
                    .restart_odometry =
                        [this] {
                            ++restarts_;
                            return CommandAnswer{0, true, "restarted"};
                        },
                    .set_log_level =
                        [](const std::string& level) {
                            return CommandAnswer{0, true, level};
                        }},
                   [this](const command_t&, const CommandAnswer& answer) { answers_.push_back(answer); }) {}

    std::uint64_t counter(const std::string& name) const {
        std::map<std::string, std::uint64_t> counters;
        handler_.visit_counters([&](std::string_view n, std::uint64_t value) { counters[std::string(n)] = value; });
        return counters.at(name);
    }

    std::vector<std::string> saved_;
    int restarts_ = 0;
    std::vector<CommandAnswer> answers_;
    CommandHandler handler_;
};

TEST_F(CommandHandlerTest, EachCommandIsCarriedOutAndAnsweredWithItsId) {
    handler_.receive(encoded(save_map(11, "hall")));
    handler_.receive(encoded(save_map(12, "bad")));
    command_t restart{};
    restart.id = 13;
    restart.command = command_t::RESTART_ODOMETRY;
    handler_.receive(encoded(restart));
    command_t unknown{};
    unknown.id = 14;
    unknown.command = 99;
    handler_.receive(encoded(unknown));
    EXPECT_EQ(saved_, (std::vector<std::string>{"hall", "bad"}));
    EXPECT_EQ(restarts_, 1);
    ASSERT_EQ(answers_.size(), 4U);
    EXPECT_EQ(answers_[0].id, 11);
    EXPECT_TRUE(answers_[0].ok);
    EXPECT_EQ(answers_[0].text, "map hall");
    EXPECT_EQ(answers_[1].id, 12);
    EXPECT_FALSE(answers_[1].ok);
    EXPECT_EQ(answers_[2].id, 13);
    EXPECT_EQ(answers_[3].id, 14);
    EXPECT_FALSE(answers_[3].ok);
    EXPECT_NE(answers_[3].text.find("99"), std::string::npos);
    EXPECT_EQ(counter("commands"), 4U);
    EXPECT_EQ(counter("commands_ignored"), 0U);
}

TEST_F(CommandHandlerTest, ACommandThatIsSentAgainIsOnlyAnsweredAgain) {
    const auto command = save_map(11, "hall");
    handler_.receive(encoded(command));
    handler_.receive(encoded(command));
    EXPECT_EQ(saved_.size(), 1U);
    ASSERT_EQ(answers_.size(), 2U);
    EXPECT_EQ(answers_[1].id, 11);
    EXPECT_EQ(answers_[1].text, answers_[0].text);
    auto later = command;
    later.utime += 1;
    handler_.receive(encoded(later));
    EXPECT_EQ(saved_.size(), 2U) << "the same id at another time is another command";
}

TEST_F(CommandHandlerTest, CommandsOfSeveralSendersAreCarriedOutOnceEach) {
    // While the first one takes its time, all of them are sent again.
    const std::vector<command_t> commands = {save_map(11, "hall"), save_map(12, "yard"), save_map(13, "bad")};
    for (int time = 0; time < 3; ++time) {
        for (const auto& command : commands) handler_.receive(encoded(command));
    }
    EXPECT_EQ(saved_, (std::vector<std::string>{"hall", "yard", "bad"}));
    ASSERT_EQ(answers_.size(), 9U);
    for (std::size_t i = 0; i < answers_.size(); ++i) {
        EXPECT_EQ(answers_[i].id, commands[i % 3].id);
        EXPECT_EQ(answers_[i].text, "map " + commands[i % 3].argument);
    }
    EXPECT_EQ(counter("commands"), 3U);
}

TEST_F(CommandHandlerTest, ManyCommandsAreCarriedOutEachOnce) {
    for (int i = 0; i < 1000; ++i) handler_.receive(encoded(save_map(i, "hall")));
    EXPECT_EQ(saved_.size(), 1000U);
    handler_.receive(encoded(save_map(999, "hall")));
    EXPECT_EQ(saved_.size(), 1000U);
    EXPECT_EQ(answers_.back().id, 999);
}

TEST_F(CommandHandlerTest, WhatIsNoCommandIsIgnoredAndCounted) {
    std::mt19937 random(1);
    const Bytes good = encoded(save_map(11, "hall"));
    handler_.receive({});
    handler_.receive(std::span(good).first(20));
    handler_.receive(encoded(pose_t{}));
    for (int i = 0; i < 200; ++i) {
        Bytes noise(random() % 300);
        for (auto& b : noise) b = static_cast<std::byte>(random());
        handler_.receive(noise);
    }
    EXPECT_EQ(counter("commands_ignored"), 203U);
    EXPECT_EQ(counter("commands"), 0U);
    EXPECT_TRUE(answers_.empty());
    EXPECT_TRUE(saved_.empty());
}

}  // namespace
}  // namespace dlod::daemon
