#include "app/client/command_client.h"

#include <grp.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "app/client/command_table.h"
#include "hal/lcm_link.h"
#include "hal/local_socket.h"
#include "tests/app/daemon/socket_bench.h"

// The client against a daemon that is played by a thread of the test: what it hears, and how it answers.
namespace trn {
namespace {

using trunnion::acknowledge_t;
using trunnion::command_t;
using trunnion::status_t;
using Clock = std::chrono::steady_clock;

constexpr std::int64_t kClockUs = 5'000'000;  // of the daemon's clock, which stands still

LcmConfig lcm() { return {"", "mill"}; }

CommandClient::Config at(const std::string& path, double timeout_s) {
  AccessConfig access;
  access.socket = path;
  return {lcm(), access, timeout_s};
}

acknowledge_t answer(const command_t& command, std::int8_t outcome, const std::string& message = "") {
  acknowledge_t out{};
  out.client = command.client;
  out.sequence = command.sequence;
  out.outcome = outcome;
  out.message = message;
  return out;
}

/// Tells its status all the time, and the motion, and does with the n-th packet of commands, from 1, what
/// the test says.
class PlayedDaemon {
 public:
  using Script = std::function<std::vector<acknowledge_t>(const command_t&, int packet)>;
  explicit PlayedDaemon(Script script) : script_(std::move(script)), thread_([this] { run(); }) {}
  const std::string& path() const { return socket_.path(); }
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
    socket_.subscribe<command_t>(lcm().command_channel(), [&](const auto& command) {
      int packet = 0;
      {
        const std::lock_guard lock(mutex_);
        heard_.push_back(command);
        packet = static_cast<int>(heard_.size());
      }
      for (const acknowledge_t& told : script_(command, packet))
        socket_.send(socket_.sender(), lcm().acknowledge_channel(), told);
    });
    for (std::int64_t count = 1; !ended_; ++count) {
      socket_.handle(5);
      if (silent_) continue;
      status_t status{};
      status.clock_us = kClockUs;
      status.count = count;
      socket_.broadcast(lcm().status_channel(), status);
      trunnion::motion_t motion{};
      motion.period = count;
      socket_.broadcast(lcm().motion_channel(), motion);
    }
  }

  Script script_;
  LocalServer socket_{socket_of_test(), static_cast<gid_t>(-1)};
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
  static double seconds_since(Clock::time_point begin) {
    return std::chrono::duration<double>(Clock::now() - begin).count();
  }
};

TEST_F(Client, RepeatsTheSameCommandUntilItIsAnswered) {
  const PlayedDaemon daemon([](const command_t& heard, int packet) {
    return packet < 3 ? std::vector<acknowledge_t>{}
                      : std::vector{answer(heard, acknowledge_t::REFUSED, "not now")};
  });
  CommandClient client(at(daemon.path(), 60));
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
  const PlayedDaemon daemon([](const command_t& heard, int packet) {
    return std::vector{answer(heard, packet < 3 ? acknowledge_t::WORKING : acknowledge_t::ACCEPTED)};
  });
  CommandClient client(at(daemon.path(), 60));
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
  CommandClient client(at(daemon.path(), 60));
  EXPECT_EQ(client.send(command(command_t::START)).outcome, +acknowledge_t::FAULT);
}

// The daemon's clock may have begun at another time than this host's.
TEST_F(Client, WhatMayNotComeLateExpiresOnTheDaemonsClock) {
  constexpr double kTimeout = 60;
  const PlayedDaemon daemon(
      [](const command_t& heard, int) { return std::vector{answer(heard, acknowledge_t::ACCEPTED)}; });
  CommandClient client(at(daemon.path(), kTimeout));
  const auto begin = Clock::now();
  client.send(command(command_t::START));
  const double took_s = seconds_since(begin);
  const double expires_s = 1e-6 * static_cast<double>(daemon.heard().back().expires_us - kClockUs);
  EXPECT_GE(expires_s, kTimeout);
  EXPECT_LE(expires_s, kTimeout + took_s);
  client.send(command(command_t::STOP));
  EXPECT_EQ(daemon.heard().back().expires_us, 0) << "what makes safe never expires";
}

TEST_F(Client, AsksForNoLongerLifeThanTheDaemonGrants) {
  const PlayedDaemon daemon(
      [](const command_t& heard, int) { return std::vector{answer(heard, acknowledge_t::ACCEPTED)}; });
  CommandClient client(at(daemon.path(), 3600));
  const auto begin = Clock::now();
  client.send(command(command_t::START));
  const double expires_s = 1e-6 * static_cast<double>(daemon.heard().back().expires_us - kClockUs);
  EXPECT_LE(expires_s, kCommandLifeMax_s + seconds_since(begin));
}

TEST_F(Client, WhereNoDaemonIsThereIsNoAnswer) {
  const auto begin = Clock::now();
  try {
    const CommandClient client(at(socket_of_test(), 0.05));
    FAIL() << "who should have answered?";
  } catch (const NoAnswer& error) {
    EXPECT_NE(std::string(error.what()).find("'mill' within 0.05 s; start one with"), std::string::npos)
        << error.what();
  }
  EXPECT_GE(seconds_since(begin), 0.05);
}

TEST_F(Client, ADaemonThatSaysNothingGivesNoAnswer) {
  PlayedDaemon daemon([](const command_t&, int) { return std::vector<acknowledge_t>{}; });
  daemon.fall_silent();
  CommandClient client(at(daemon.path(), 0.05));
  EXPECT_THROW(client.send(command(command_t::STOP)), NoAnswer);
  EXPECT_THROW(client.wait_status([](const auto&) { return true; }, 60), NoAnswer);
  EXPECT_THROW(client.watch([](const auto&, const auto&) { return true; }), NoAnswer);
}

TEST_F(Client, ADaemonThatGoesIsNoticed) {
  auto daemon = std::make_unique<PlayedDaemon>(
      [](const command_t& heard, int) { return std::vector{answer(heard, acknowledge_t::ACCEPTED)}; });
  CommandClient client(at(daemon->path(), 60));
  EXPECT_EQ(client.send(command(command_t::STOP)).outcome, +acknowledge_t::ACCEPTED);
  daemon.reset();
  EXPECT_THROW(client.send(command(command_t::STOP)), NoAnswer);
  EXPECT_THROW(client.wait_status([](const auto&) { return false; }, 60), NoAnswer);
}

/// What `work` says in a process of user nobody.
std::string said_by_nobody(const std::function<std::string()>& work) {
  int ends[2];
  if (pipe(ends) != 0) return "no pipe";
  const pid_t child = fork();
  if (child == 0) {
    std::string said =
        setgroups(0, nullptr) == 0 && setgid(65534) == 0 && setuid(65534) == 0 ? "" : "still root";
    if (said.empty()) said = work();
    _exit(write(ends[1], said.data(), said.size()) == static_cast<ssize_t>(said.size()) ? 0 : 1);
  }
  close(ends[1]);
  std::string said(1000, '\0');
  said.resize(static_cast<std::size_t>(std::max<ssize_t>(0, read(ends[0], said.data(), said.size()))));
  close(ends[0]);
  waitpid(child, nullptr, 0);
  return said;
}

// What a client at `path` is told when it does not get through.
std::string refusal_at(const std::string& path) {
  try {
    const CommandClient client(at(path, 0.05));
    return "it got through";
  } catch (const NoAnswer& error) {
    return error.what();
  }
}

TEST_F(Client, AUserWithoutTheGroupIsToldWhichOneItNeeds) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can be somebody else";
  const PlayedDaemon daemon([](const command_t&, int) { return std::vector<acknowledge_t>{}; });
  const std::string said = said_by_nobody([&] { return refusal_at(daemon.path()); });
  EXPECT_NE(said.find("needs group 'trunnion' (usermod -aG trunnion USER"), std::string::npos) << said;
}

// Somebody else's socket under the machine's name must not learn or swallow commands.
TEST_F(Client, ASocketOfAnUntrustedUserIsNotUsed) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can be somebody else";
  const std::string folder = testing::TempDir() + "open";
  ASSERT_EQ(mkdir(folder.c_str(), 0777), 0);
  ASSERT_EQ(chmod(folder.c_str(), 0777), 0);
  const std::string path = folder + "/socket";
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const pid_t child = fork();
  if (child == 0) {
    if (setuid(65534) != 0) _exit(1);
    const LocalServer server(path, static_cast<gid_t>(-1));
    char end = 0;
    const bool told = write(ends[1], "!", 1) == 1;
    _exit(told && read(ends[0], &end, 0) == 0 && pause() == 0 ? 0 : 1);
  }
  char ready = 0;
  ASSERT_EQ(read(ends[0], &ready, 1), 1);
  const std::string said = refusal_at(path);
  EXPECT_NE(said.find("whom nobody here trusts"), std::string::npos) << said;
  kill(child, SIGKILL);
  waitpid(child, nullptr, 0);
}

TEST_F(Client, ADaemonThatFallsSilentAtWorkIsNoticed) {
  std::atomic<PlayedDaemon*> self = nullptr;
  PlayedDaemon daemon([&self](const command_t& heard, int packet) {
    self.load()->fall_silent();
    return packet > 1 ? std::vector<acknowledge_t>{} : std::vector{answer(heard, acknowledge_t::WORKING)};
  });
  self = &daemon;
  CommandClient client(at(daemon.path(), 0.5));
  EXPECT_THROW(client.send(command(command_t::LOAD)), NoAnswer);
}

TEST_F(Client, WaitsForTheStatusThatIsWanted) {
  const PlayedDaemon daemon([](const command_t&, int) { return std::vector<acknowledge_t>{}; });
  CommandClient client(at(daemon.path(), 60));
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
  CommandClient client(at(daemon.path(), 60));
  std::vector<std::int64_t> periods;
  client.watch([&](const trunnion::status_t& status, const trunnion::motion_t& motion) {
    EXPECT_EQ(status.clock_us, kClockUs);
    periods.push_back(motion.period);
    return periods.size() < 10;
  });
  ASSERT_EQ(periods.size(), 10u);
  for (std::size_t i = 1; i < periods.size(); ++i) EXPECT_GT(periods[i], periods[i - 1]);
}

}  // namespace
}  // namespace trn
