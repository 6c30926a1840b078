#include "daemon/publish/predicted_pose_thread.hpp"

#include <gtest/gtest.h>

#include <condition_variable>
#include <mutex>
#include <vector>

namespace dlod::daemon {
namespace {

ImuSample reading(int i) {
    ImuSample sample;
    sample.stamp_ns = i;
    return sample;
}

/// Takes readings, and none while it is held up.
class Receiver {
  public:
    void take(const ImuSample& sample) {
        std::unique_lock lock(mutex_);
        begun_ = true;
        changed_.notify_all();
        changed_.wait(lock, [&] { return !held_up_; });
        taken_.push_back(sample.stamp_ns);
        changed_.notify_all();
    }
    void hold_up(bool held_up) {
        const std::lock_guard lock(mutex_);
        held_up_ = held_up;
        changed_.notify_all();
    }
    void wait_until_begun() {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return begun_; });
    }
    std::vector<std::int64_t> wait_for(std::size_t readings) {
        std::unique_lock lock(mutex_);
        changed_.wait(lock, [&] { return taken_.size() >= readings; });
        return taken_;
    }

  private:
    std::mutex mutex_;
    std::condition_variable changed_;
    bool held_up_ = false;
    bool begun_ = false;
    std::vector<std::int64_t> taken_;
};

TEST(PredictedPoseThread, HandsOnEveryReadingInOrderOnAThreadOfItsOwn) {
    Receiver receiver;
    std::thread::id publishing;
    PredictedPoseThread thread([&](const ImuSample& sample) { receiver.take(sample); },
                               [&] { publishing = std::this_thread::get_id(); });
    std::vector<std::int64_t> expected;
    for (int i = 0; i < 200; ++i) {
        thread.add(reading(i));
        expected.push_back(i);
        if (i % 20 == 0) receiver.wait_for(expected.size());
    }
    EXPECT_EQ(receiver.wait_for(200), expected);
    EXPECT_NE(publishing, std::this_thread::get_id());
    EXPECT_EQ(thread.left_out(), 0U);
}

TEST(PredictedPoseThread, AStalledPeerHoldsUpNobodyButItself) {
    Receiver receiver;
    receiver.hold_up(true);
    PredictedPoseThread thread([&](const ImuSample& sample) { receiver.take(sample); }, {});
    thread.add(reading(0));
    receiver.wait_until_begun();
    constexpr std::size_t kMost = PredictedPoseThread::kMostWaiting;
    for (int i = 1; i <= 1000; ++i) thread.add(reading(i));
    EXPECT_EQ(thread.left_out(), 1000 - kMost) << "bounded, and counted";
    receiver.hold_up(false);
    const auto taken = receiver.wait_for(1 + kMost);
    for (std::size_t i = 0; i < taken.size(); ++i) EXPECT_EQ(taken[i], static_cast<std::int64_t>(i));
    thread.add(reading(2000));
    EXPECT_EQ(receiver.wait_for(2 + kMost).back(), 2000) << "it goes on";
}

TEST(PredictedPoseThread, EndsWithReadingsWaiting) {
    for (int run = 0; run < 50; ++run) {
        int published = 0;
        {
            PredictedPoseThread thread([&](const ImuSample&) { ++published; }, {});
            for (int i = 0; i < run; ++i) thread.add(reading(i));
        }
        EXPECT_LE(published, run);
    }
}

}  // namespace
}  // namespace dlod::daemon
