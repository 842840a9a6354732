#include "app/daemon/command_client.h"

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "hal/lcm_link.h"
#include "tests/app/daemon/local_group.h"

// The client against a daemon that is played by a thread of the test: what it hears, and how it answers.
namespace trn {
namespace {

using trunnion::acknowledge_t;
using trunnion::command_t;
using trunnion::status_t;
using Clock = std::chrono::steady_clock;

constexpr std::int64_t kClockUs = 5'000'000;  // of the daemon's clock, which stands still

LcmConfig lcm() { return {local_group(), "mill"}; }

acknowledge_t answer(const command_t& command, std::int8_t outcome, const std::string& message = "") {
  acknowledge_t out{};
  out.client = command.client;
  out.sequence = command.sequence;
  out.outcome = outcome;
  out.message = message;
  return out;
}

/// Tells its status all the time, and the motion, and does with the n-th datagram of commands, from 1, what
/// the test says.
class PlayedDaemon {
 public:
  using Script = std::function<std::vector<acknowledge_t>(const command_t&, int datagram)>;
  explicit PlayedDaemon(Script script) : script_(std::move(script)), thread_([this] { run(); }) {}
  ~PlayedDaemon() {
    ended_ = true;
    thread_.join();
  }
  PlayedDaemon(const PlayedDaemon&) = delete;
  PlayedDaemon& operator=(const PlayedDaemon&) = delete;

  /// Says no more.
  void fall_silent() { silent_ = true; }
  std::vector<command_t> heard() const {
    const std::lock_guard lock(mutex_);
    return heard_;
  }

 private:
  void run() {
    LcmLink link(lcm().url);
    link.subscribe<command_t>(lcm().command_channel(), [&](const auto& command) {
      int datagram = 0;
      {
        const std::lock_guard lock(mutex_);
        heard_.push_back(command);
        datagram = static_cast<int>(heard_.size());
      }
      for (const acknowledge_t& told : script_(command, datagram))
        link.publish(lcm().acknowledge_channel(), told);
    });
    for (std::int64_t count = 1; !ended_; ++count) {
      link.handle(5);
      if (silent_) continue;
      status_t status{};
      status.clock_us = kClockUs;
      status.count = count;
      link.publish(lcm().status_channel(), status);
      trunnion::motion_t motion{};
      motion.period = count;
      link.publish(lcm().motion_channel(), motion);
    }
  }

  Script script_;
  mutable std::mutex mutex_;
  std::vector<command_t> heard_;  // guarded by mutex_
  std::atomic<bool> ended_ = false, silent_ = false;
  std::thread thread_;
};

command_t command(std::int8_t verb) {
  command_t out{};
  out.verb = verb;
  return out;
}

class Client : public ::testing::Test {
 protected:
  void SetUp() override {
    if (const std::string bad = lcm_self_test(lcm().url); !bad.empty()) GTEST_SKIP() << bad;
  }
  static double seconds_since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
  }
};

TEST_F(Client, RepeatsTheSameCommandUntilItIsAnswered) {
  const PlayedDaemon daemon([](const command_t& heard, int datagram) {
    return datagram < 3 ? std::vector<acknowledge_t>{}
                        : std::vector{answer(heard, acknowledge_t::REFUSED, "not now")};
  });
  CommandClient client({lcm(), 60});
  const acknowledge_t told = client.send(command(command_t::START));
  EXPECT_EQ(told.outcome, +acknowledge_t::REFUSED);
  EXPECT_EQ(told.message, "not now");
  const std::vector<command_t> heard = daemon.heard();
  ASSERT_GE(heard.size(), 3u);
  for (const command_t& copy : heard) {
    EXPECT_EQ(copy.sequence, 1);
    EXPECT_EQ(copy.client, heard[0].client);
    EXPECT_EQ(copy.verb, +command_t::START);
  }
  client.send(command(command_t::HOLD));
  EXPECT_EQ(daemon.heard().back().sequence, 2);
}

TEST_F(Client, WaitsForTheFinalWordAndAsksForItAgain) {
  const PlayedDaemon daemon([](const command_t& heard, int datagram) {
    return std::vector{answer(heard, datagram < 3 ? acknowledge_t::WORKING : acknowledge_t::ACCEPTED)};
  });
  CommandClient client({lcm(), 60});
  EXPECT_EQ(client.send(command(command_t::LOAD)).outcome, +acknowledge_t::ACCEPTED);
  EXPECT_GE(daemon.heard().size(), 3u);
  EXPECT_EQ(daemon.heard().back().sequence, 1) << "it is the same command";
}

TEST_F(Client, AnswersToOthersAreNotItsOwn) {
  const PlayedDaemon daemon([](const command_t& heard, int) {
    acknowledge_t stranger = answer(heard, acknowledge_t::ACCEPTED), older = stranger;
    stranger.client += 2;
    older.sequence -= 1;
    return std::vector{stranger, older, answer(heard, acknowledge_t::FAULT)};
  });
  CommandClient client({lcm(), 60});
  EXPECT_EQ(client.send(command(command_t::START)).outcome, +acknowledge_t::FAULT);
}

// The daemon's clock may have begun at another time than this host's.
TEST_F(Client, WhatMayNotComeLateExpiresOnTheDaemonsClock) {
  constexpr double kTimeout = 60;
  const PlayedDaemon daemon(
      [](const command_t& heard, int) { return std::vector{answer(heard, acknowledge_t::ACCEPTED)}; });
  CommandClient client({lcm(), kTimeout});
  const auto begin = Clock::now();
  client.send(command(command_t::START));
  const double took_s = seconds_since(begin);
  const double expires_s = 1e-6 * static_cast<double>(daemon.heard().back().expires_us - kClockUs);
  EXPECT_GE(expires_s, kTimeout);
  EXPECT_LE(expires_s, kTimeout + took_s);
  client.send(command(command_t::STOP));
  EXPECT_EQ(daemon.heard().back().expires_us, 0) << "what makes safe never expires";
}

// The clock of a daemon comes with its status, ten times a second: a shorter timeout waits for that all the
// same.
TEST_F(Client, WhereNoDaemonIsThereIsNoAnswer) {
  CommandClient client({lcm(), 0.05});
  auto begin = Clock::now();
  try {
    client.send(command(command_t::START));
    FAIL() << "who should have answered?";
  } catch (const NoAnswer& error) {
    EXPECT_NE(std::string(error.what()).find("'mill' on " + lcm().url + " within 0.05 s"), std::string::npos)
        << error.what();
  }
  EXPECT_GE(seconds_since(begin), 0.5);
  begin = Clock::now();
  EXPECT_THROW(client.send(command(command_t::STOP)), NoAnswer);
  EXPECT_GE(seconds_since(begin), 0.05);
  EXPECT_THROW(client.wait_status([](const auto&) { return true; }, 60), NoAnswer);
  EXPECT_THROW(client.watch_motion([](const auto&) { return true; }), NoAnswer);
}

TEST_F(Client, ADaemonThatFallsSilentAtWorkIsNoticed) {
  std::atomic<PlayedDaemon*> self = nullptr;
  PlayedDaemon daemon([&self](const command_t& heard, int datagram) {
    self.load()->fall_silent();
    return datagram > 1 ? std::vector<acknowledge_t>{} : std::vector{answer(heard, acknowledge_t::WORKING)};
  });
  self = &daemon;
  CommandClient client({lcm(), 0.5});
  EXPECT_THROW(client.send(command(command_t::LOAD)), NoAnswer);
}

TEST_F(Client, WaitsForTheStatusThatIsWanted) {
  const PlayedDaemon daemon([](const command_t&, int) { return std::vector<acknowledge_t>{}; });
  CommandClient client({lcm(), 60});
  std::int64_t seen = 0;
  const auto found = client.wait_status(
      [&](const status_t& status) {
        ++seen;
        return seen == 5 && status.clock_us == kClockUs;
      },
      60);
  EXPECT_TRUE(found);
  EXPECT_EQ(seen, 5);
  EXPECT_FALSE(client.wait_status([](const auto&) { return false; }, 0.2)) << "others do not count";
}

TEST_F(Client, ShowsEveryMotionUntilThatIsEnough) {
  const PlayedDaemon daemon([](const command_t&, int) { return std::vector<acknowledge_t>{}; });
  CommandClient client({lcm(), 60});
  std::vector<std::int64_t> periods;
  client.watch_motion([&](const trunnion::motion_t& motion) {
    periods.push_back(motion.period);
    return periods.size() < 10;
  });
  ASSERT_EQ(periods.size(), 10u);
  for (std::size_t i = 1; i < periods.size(); ++i) EXPECT_GT(periods[i], periods[i - 1]);
}

// Once a daemon has answered, only its own clock counts, whoever else tells a status.
TEST_F(Client, AStrangersClockDoesNotCount) {
  const PlayedDaemon daemon(
      [](const command_t& heard, int) { return std::vector{answer(heard, acknowledge_t::ACCEPTED)}; });
  CommandClient client({lcm(), 60});
  client.send(command(command_t::START));
  LcmLink stranger(lcm().url);
  status_t status{};
  status.clock_us = 900'000'000'000;
  for (int i = 0; i < 20; ++i) {
    stranger.publish(lcm().status_channel(), status);
    client.send(command(command_t::START));
    EXPECT_LT(daemon.heard().back().expires_us, 800'000'000'000);
  }
}

}  // namespace
}  // namespace trn
