#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <thread>

#include "kernel/daemon/command_desk.h"
#include "kernel/daemon/worker.h"

namespace trn {
namespace {

using trunnion::acknowledge_t;
using trunnion::command_t;

std::int64_t unix_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

struct Bench {
  Bench() {
    link.subscribe<acknowledge_t>(config.acknowledge_channel(),
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
    link.publish(config.command_channel(), command);
    while (link.handle(20)) {
    }
  }
  LcmConfig config{LcmConfig::kDefaultUrl, "bench"};
  LcmLink link{"memq://"};
  std::vector<acknowledge_t> heard;
  std::vector<int> obeyed;
  std::int8_t outcome = acknowledge_t::ACCEPTED;
  std::optional<CommandDesk::Ticket> ticket;
  CommandDesk desk{link, config,
                   [this](const command_t& c, const CommandDesk::Ticket& t) {
                     obeyed.push_back(c.sequence);
                     ticket = t;
                     return CommandDesk::Answer{outcome, ""};
                   },
                   [] { return 17; }};
};

TEST(CommandDesk, ObeysOnceAndAnswersEveryCopy) {
  Bench bench;
  for (int copy = 0; copy < 3; ++copy) bench.send(bench.command(1));
  bench.send(bench.command(2));
  EXPECT_EQ(bench.obeyed, (std::vector<int>{1, 2}));
  ASSERT_EQ(bench.heard.size(), 4u);
  EXPECT_EQ(bench.heard[2].sequence, 1);
  EXPECT_EQ(bench.heard[2].outcome, +acknowledge_t::ACCEPTED);
  EXPECT_EQ(bench.heard[2].status_count, 17);
}

TEST(CommandDesk, RefusesWhatHasExpired) {
  Bench bench;
  command_t late = bench.command(1);
  late.expires_us = unix_us() - 1;
  bench.send(late);
  EXPECT_TRUE(bench.obeyed.empty());
  ASSERT_EQ(bench.heard.size(), 1u);
  EXPECT_EQ(bench.heard[0].outcome, +acknowledge_t::REFUSED);
  late.sequence = 2;
  late.expires_us = unix_us() + 10'000'000;
  bench.send(late);
  EXPECT_EQ(bench.obeyed, std::vector<int>{2});
}

TEST(CommandDesk, WorkingCommandsGetTheirFinalAnswerLater) {
  Bench bench;
  bench.outcome = acknowledge_t::WORKING;
  bench.send(bench.command(5));
  bench.send(bench.command(5));
  ASSERT_EQ(bench.heard.size(), 2u);
  EXPECT_EQ(bench.heard[1].outcome, +acknowledge_t::WORKING);
  bench.desk.finish(*bench.ticket, {acknowledge_t::BAD_PROGRAM, "a.ngc:1:1: no"});
  bench.send(bench.command(5));
  ASSERT_EQ(bench.heard.size(), 4u);
  EXPECT_EQ(bench.heard[2].outcome, +acknowledge_t::BAD_PROGRAM);
  EXPECT_EQ(bench.heard[3].message, "a.ngc:1:1: no");
  EXPECT_EQ(bench.obeyed, std::vector<int>{5});
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
