#include "app/daemon/command_server.h"

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <thread>

#include "app/client/command_table.h"
#include "app/daemon/telemetry.h"
#include "app/daemon/worker.h"
#include "tests/app/daemon/socket_bench.h"

namespace trn {
namespace {

using trunnion::acknowledge_t;
using trunnion::command_t;

struct Bench {
  Bench() {
    socket.client.subscribe<acknowledge_t>(config.acknowledge_channel(),
                                           [this](const auto& answer) { heard.push_back(answer); });
  }
  command_t command(std::int32_t sequence) const {
    command_t out{};
    out.client = 99;
    out.sequence = sequence;
    out.verb = command_t::START;
    return out;
  }
  void send(const command_t& command) {
    publish(command);
    socket.pump();
  }
  void publish(const command_t& command) { socket.client.publish(config.command_channel(), command); }
  LcmConfig config{LcmConfig::kDefaultUrl, "bench"};
  SocketBench socket;
  std::vector<acknowledge_t> heard;
  std::vector<int> obeyed;
  bool ready = true, fails = false;
  std::int8_t outcome = acknowledge_t::ACCEPTED;
  std::optional<CommandServer::Ticket> ticket;
  CommandServer server{socket.server,
                       socket.access,
                       config,
                       [this](const command_t& c, const CommandServer::Ticket& t) {
                         if (fails) throw std::runtime_error("no thread");
                         obeyed.push_back(c.sequence);
                         ticket = t;
                         return CommandServer::Answer{outcome, ""};
                       },
                       [] { return 17; },
                       [this] { return ready; }};
};

TEST(CommandServer, ObeysOnceAndAnswersEveryCopy) {
  Bench bench;
  for (int copy = 0; copy < 3; ++copy) bench.send(bench.command(1));
  bench.send(bench.command(2));
  EXPECT_EQ(bench.obeyed, (std::vector<int>{1, 2}));
  ASSERT_EQ(bench.heard.size(), 4u);
  EXPECT_EQ(bench.heard[2].sequence, 1);
  EXPECT_EQ(bench.heard[2].outcome, +acknowledge_t::ACCEPTED);
  EXPECT_EQ(bench.heard[2].status_count, 17);
}

TEST(CommandServer, RefusesWhatHasExpired) {
  Bench bench;
  command_t late = bench.command(1);
  late.expires_us = daemon_clock_us() - 1;
  bench.send(late);
  EXPECT_TRUE(bench.obeyed.empty());
  ASSERT_EQ(bench.heard.size(), 1u);
  EXPECT_EQ(bench.heard[0].outcome, +acknowledge_t::REFUSED);
  late.sequence = 2;
  late.expires_us = daemon_clock_us() + 10'000'000;
  bench.send(late);
  EXPECT_EQ(bench.obeyed, std::vector<int>{2});
  late.expires_us = 1;
  late.verb = command_t::ESTOP;
  late.sequence = 3;
  bench.send(late);
  EXPECT_EQ(bench.obeyed.back(), 3) << "what makes safe never expires";
}

// One that lives for days could be held back on the way, and be obeyed after a restart.
TEST(CommandServer, RefusesWhatWouldExpireInLongerThanAnyClientAsksFor) {
  constexpr auto kMost_us = static_cast<std::int64_t>(1e6 * kCommandLifeMax_s);
  Bench bench;
  command_t command = bench.command(1);
  command.expires_us = daemon_clock_us() + kMost_us + 5'000'000;
  bench.send(command);
  EXPECT_TRUE(bench.obeyed.empty());
  ASSERT_EQ(bench.heard.size(), 1u);
  EXPECT_EQ(bench.heard[0].outcome, +acknowledge_t::REFUSED);
  EXPECT_NE(bench.heard[0].message.find("more than 60 s"), std::string::npos) << bench.heard[0].message;
  command.sequence = 2;
  command.expires_us = daemon_clock_us() + kMost_us;
  bench.send(command);
  EXPECT_EQ(bench.obeyed, std::vector<int>{2});
  command.sequence = 3;
  command.verb = command_t::ESTOP;
  command.expires_us = daemon_clock_us() + 100 * kMost_us;
  bench.send(command);
  EXPECT_EQ(bench.obeyed.back(), 3) << "no clock stands before a stop";
}

// A client that is hours behind or ahead must be able to stop the machine.
TEST(CommandServer, WhatMakesTheMachineSaferNeverExpires) {
  const struct {
    std::int8_t verb;
    double value;
    bool always;
  } kCommands[] = {{command_t::ESTOP, 0, true},          {command_t::STOP, 0, true},
                   {command_t::HOLD, 0, true},           {command_t::OVERRIDE, 0, true},
                   {command_t::RAPID_OVERRIDE, 0, true}, {command_t::ADAPTIVE_FEED, 0, true},
                   {command_t::OVERRIDE, 0.01, false},   {command_t::SPINDLE_OVERRIDE, 0, false},
                   {command_t::RESUME, 0, false},        {command_t::START, 0, false},
                   {command_t::JOG, 0, false},           {command_t::MDI, 0, false},
                   {command_t::HOME, 0, false},          {command_t::RESET, 0, false},
                   {command_t::SINGLE_BLOCK, 0, false},  {command_t::LOAD, 0, false},
                   {command_t::CORRECTION, 0, false}};
  Bench bench;
  std::int32_t sequence = 0;
  for (const auto& [verb, value, always] : kCommands)
    for (const std::int64_t expires_us : {std::int64_t{1}, std::int64_t{-1}, daemon_clock_us() - 1}) {
      command_t command = bench.command(++sequence);
      command.verb = verb;
      command.value = value;
      command.expires_us = expires_us;
      bench.obeyed.clear();
      bench.send(command);
      EXPECT_EQ(bench.obeyed.size(), always ? 1U : 0U) << int{verb} << " " << expires_us;
    }
}

TEST(CommandServer, WorkingCommandsGetTheirFinalAnswerLater) {
  Bench bench;
  bench.outcome = acknowledge_t::WORKING;
  bench.send(bench.command(5));
  bench.send(bench.command(5));
  ASSERT_EQ(bench.heard.size(), 2u);
  EXPECT_EQ(bench.heard[1].outcome, +acknowledge_t::WORKING);
  bench.server.finish(*bench.ticket, {acknowledge_t::BAD_PROGRAM, "a.ngc:1:1: no"});
  bench.send(bench.command(5));
  ASSERT_EQ(bench.heard.size(), 4u);
  EXPECT_EQ(bench.heard[2].outcome, +acknowledge_t::BAD_PROGRAM);
  EXPECT_EQ(bench.heard[3].message, "a.ngc:1:1: no");
  EXPECT_EQ(bench.obeyed, std::vector<int>{5});
}

TEST(CommandServer, AFloodIsRefusedAndNeverAcknowledgedAsObeyed) {
  Bench bench;
  for (int i = 1; i <= 2000; ++i) {
    bench.send(bench.command(i));
    bench.server.poll();
  }
  std::vector<int> accepted;
  for (const acknowledge_t& answer : bench.heard)
    if (answer.outcome == acknowledge_t::ACCEPTED) accepted.push_back(answer.sequence);
  EXPECT_EQ(accepted, bench.obeyed);
  EXPECT_GE(bench.obeyed.size(), 100u);
  EXPECT_LT(bench.obeyed.size(), 2000u) << "200 a second";
}

// Whatever waits, however long the flood: the stop acts when it comes, and nothing from before it acts behind
// it.
TEST(CommandServer, AStopInAFloodActsAtOnceAndEndsTheWaiting) {
  for (const std::int8_t stop : {command_t::ESTOP, command_t::STOP, command_t::HOLD, command_t::OVERRIDE}) {
    Bench bench;
    bench.ready = false;
    for (int i = 1; i <= 300; ++i) {
      command_t command = bench.command(i);
      if (i == 290) command.verb = stop;
      bench.publish(command);
      bench.socket.server.handle(0);
    }
    bench.socket.pump();
    bench.server.poll();
    EXPECT_EQ(bench.obeyed, std::vector<int>{290});
    bench.ready = true;
    bench.server.poll();
    for (const int sequence : bench.obeyed) EXPECT_GE(sequence, 290);
  }
}

// The machine is busy, and one process has filled its share of what may wait.
TEST(CommandServer, AFloodKeepsNoOthersCommandFromWaiting) {
  Bench bench;
  bench.ready = false;
  for (int i = 1; i <= 90; ++i) bench.send(bench.command(i));
  const pid_t child = fork();
  if (child == 0) {
    LocalClient other(bench.socket.path);
    other.publish(bench.config.command_channel(), bench.command(500));
    _exit(0);
  }
  ASSERT_EQ(waitpid(child, nullptr, 0), child);
  bench.socket.pump();
  bench.ready = true;
  bench.server.poll();
  ASSERT_EQ(bench.obeyed.size(), 17u);
  EXPECT_EQ(bench.obeyed.front(), 1);
  EXPECT_EQ(bench.obeyed.back(), 500);
  ASSERT_GE(bench.heard.size(), 74u) << "who is turned away is told";
  EXPECT_EQ(bench.heard.front().sequence, 17);
  EXPECT_NE(bench.heard.front().message.find("16 commands"), std::string::npos);
}

TEST(CommandServer, ACommandThatFailsIsAnswered) {
  Bench bench;
  bench.fails = true;
  bench.send(bench.command(1));
  ASSERT_EQ(bench.heard.size(), 1u);
  EXPECT_EQ(bench.heard[0].outcome, +acknowledge_t::REFUSED);
  EXPECT_NE(bench.heard[0].message.find("no thread"), std::string::npos);
}

TEST(CommandGate, LimitsASenderAndAllTogether) {
  CommandGate gate;
  const auto start = CommandGate::Clock::now();
  int one = 0, many = 0;
  for (int i = 0; i < 20'000; ++i)
    one += gate.admit({1, 1}, start + std::chrono::microseconds(50 * i)) ? 1 : 0;
  EXPECT_NEAR(one, CommandGate::kSenderBurst + CommandGate::kSenderRate, 2);
  EXPECT_TRUE(gate.admit({1, 2}, start + std::chrono::seconds(1))) << "another sender is heard";
  for (int i = 0; i < 20'000; ++i)
    many += gate.admit({2, static_cast<pid_t>(i)}, start + std::chrono::microseconds(1000000 + 50 * i));
  EXPECT_LE(many, CommandGate::kTotalBurst + CommandGate::kTotalRate + 1) << "a new process for each command";
  EXPECT_TRUE(gate.must_tell(start));
  EXPECT_FALSE(gate.must_tell(start + std::chrono::seconds(59)));
}

TEST(Worker, DoesJobsInOrderAndFinishesThemInTheOwnersThread) {
  Worker worker;
  std::vector<int> finished;
  std::atomic<int> done = 0;
  for (int i = 0; i < 20; ++i)
    worker.post([&, i] {
      EXPECT_EQ(done.load(), i);
      ++done;
      return Worker::Done([&finished, i] { finished.push_back(i); });
    });
  while (done < 20) std::this_thread::yield();
  while (finished.size() < 20) worker.collect();
  for (int i = 0; i < 20; ++i) EXPECT_EQ(finished[static_cast<std::size_t>(i)], i);
}

}  // namespace
}  // namespace trn
