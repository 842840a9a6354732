#include "app/daemon/rate_planner_thread.h"

#include <gtest/gtest.h>

#include <chrono>
#include <random>
#include <string>
#include <thread>

#include "app/check/limit_judge.h"
#include "app/session/assembly.h"
#include "tests/app/session/session_bench.h"
#include "tests/kernel/planned_motion.h"
#include "tests/support/paths.h"

// The rate planner in a thread of its own, before a tick that goes as fast as it likes, or stands for a
// while: answers come in time or late, as the host has it. Whatever happened, a replay gives the same bits.
namespace trn {
namespace {

std::string config() { return source_dir() + "/configs/cradle.toml"; }

RealtimeConfig no_rights() {
  RealtimeConfig realtime;
  realtime.priority = 0;
  return realtime;
}

void expect_within_limits(const SessionBench& bench) {
  JointJudge judge(bench.assembly().machine.joints, bench.assembly().machine.period_s);
  for (const JointVec& q : bench.rows()) judge(q);
  std::string where;
  EXPECT_LE(judge.worst(&where), LimitJudge::kRatioMax) << where;
}

TEST(RatePlannerThread, IsReplayedToTheBit) {
  const Assembly assembly = assemble(config());
  for (std::uint64_t seed = 1; seed <= 3; ++seed) {
    RatePlannerThread thread(assembly.plan_joints, assembly.machine.period_s);
    thread.start(no_rights());
    SessionBench bench(seed, config(), &thread);
    std::mt19937_64 rng(seed);
    std::uniform_int_distribution<int> pace(0, 3);
    int periods = 0, pause_us = 0;
    bench.before_tick = [&] {
      if (periods++ % 500 == 0) pause_us = 150 * pace(rng);
      if (pause_us > 0) std::this_thread::sleep_for(std::chrono::microseconds(pause_us));
    };
    bench.run(4000);
    expect_same_bits(bench, seed, config());
    expect_within_limits(bench);
    std::printf("%u answers were late\n", bench.report().late_rate_plans);
  }
}

// The machine comes to rest on its path, and the report says why.
TEST(RatePlannerThread, StandsWhenItIsGone) {
  const Assembly assembly = assemble(config());
  RatePlannerThread thread(assembly.plan_joints, assembly.machine.period_s);
  thread.start(no_rights());
  SessionBench bench(1, config(), &thread);
  int periods = 0;
  bench.before_tick = [&] {
    std::this_thread::sleep_for(std::chrono::microseconds(200));
    if (++periods == 3000) thread.stop_thread();
  };
  bench.run(6000);
  expect_same_bits(bench, 1, config());
  expect_within_limits(bench);
  EXPECT_TRUE(bench.report().rate_plan_late);
  for (std::size_t i = bench.rows().size() - 100; i + 1 < bench.rows().size(); ++i)
    ASSERT_EQ(bench.rows()[i], bench.rows()[i + 1]) << "moves without a rate planner";
}

}  // namespace
}  // namespace trn
