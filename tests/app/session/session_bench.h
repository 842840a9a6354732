#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/inline_rate_plans.h"
#include "app/session/make_cycle.h"
#include "app/session/pipeline.h"
#include "app/session/replay.h"
#include "app/session/session_log.h"
#include "compensation/sensor_board.h"
#include "core/axes.h"
#include "core/motion.h"
#include "core/ports.h"
#include "hal/loopback.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rate_plans.h"
#include "kernel/rt_messages.h"

namespace trn {

struct SessionRows : ReportSink {
  void write(const CycleReport& report) override { q.push_back(report.q_setpoint); }
  std::vector<JointVec> q;
};

/// A session as the daemon has it, in one thread: random commands, and a planner that sometimes sleeps.
class SessionBench {
 public:
  /// `rate_plans` null: made in this thread, and sometimes late.
  SessionBench(std::uint64_t seed, const std::string& config, RatePlans* rate_plans = nullptr)
      : rng_(seed),
        assembly_(assemble(config)),
        inline_plans_(assembly_.plan_joints, assembly_.machine.period_s),
        drives_(JointVec::Zero(5)),
        queue_(8192),
        cycle_(make_cycle(assembly_, queue_, ProgramStops::kWait, drives_, nullptr,
                          rate_plans ? *rate_plans : inline_plans_)),
        log_(log_path(), {config, "", ""}) {
    drives_.bring_up();
  }
  /// Called before every tick.
  std::function<void()> before_tick = {};
  static std::string log_path() {
    return testing::TempDir() + testing::UnitTest::GetInstance()->current_test_info()->name() + ".log";
  }

  void run(int periods) {
    std::uniform_int_distribution<int> wait(1, 300), kind(0, 7);
    std::uniform_real_distribution<double> value(0, 2);
    int next = 5, planner_sleeps = 0, until_late = 500;
    for (int i = 0; i < periods; ++i) {
      if (cycle_.last_report().motion == MotionState::kRest && i > 3) begin();
      if (--planner_sleeps < 0) fill();
      if (--until_late == 0) inline_plans_.set_late(true);
      if (until_late < -late_for_(rng_)) {
        until_late = 20 * wait(rng_);
        inline_plans_.set_late(false);
      }
      if (--next == 0) {
        next = wait(rng_);
        using Kind = RtCommand::Kind;
        const Kind kinds[] = {Kind::kHold,     Kind::kResume, Kind::kOverride, Kind::kOverride,
                              Kind::kOverride, Kind::kStop,   Kind::kResume,   Kind::kResume};
        post({kinds[kind(rng_)], value(rng_)});
        if (kind(rng_) < 2) planner_sleeps = 8 * wait(rng_);
      }
      tick();
    }
  }
  const Assembly& assembly() const { return assembly_; }
  const CycleReport& report() const { return cycle_.last_report(); }
  const std::vector<JointVec>& rows() const { return rows_.q; }

 private:
  void post(RtCommand command) {
    command.id = ++id_;
    log_.posted(command);
    cycle_.post(command);
  }
  void tick() {
    const int channels = static_cast<int>(assembly_.corrections.sensors->names().size());
    std::uniform_int_distribution<int> when(0, 400);
    if (const int n = when(rng_); n < channels)
      assembly_.corrections.sensors->publish(n, 24 + 0.001 * when(rng_));
    if (before_tick) before_tick();
    cycle_.tick();
    for (const auto& work : assembly_.corrections.background) work();
    log_.report(cycle_.last_report());
    if (cycle_.last_report().drives == DriveState::kEnabled) rows_.write(cycle_.last_report());
  }
  void begin() {
    post({RtCommand::Kind::kStop});
    do tick();
    while (queue_.holds_stop() || queue_.buffered_s() > 0);  // often at once, in the period of the stop
    const ProgramStart start{
        "mdi", "G21 G94 G64 P0.02\nG91\nG1 F4000 X20\nY20 A5\nX-20 C10\nF900 Y-20 A-5\nX5 C-10\nX-5\n",
        cycle_.last_report().q_setpoint};
    pipeline_.emplace(assembly_, parameters_, tools_, start, PipelineObservers{});
    log_.program(start);
    queue_.begin_generation();
    ended_ = has_block_ = false;
    fill();
    post({RtCommand::Kind::kStart});
  }
  void fill() {
    while (pipeline_ && !ended_ && queue_.buffered_s() < assembly_.planner.buffer_s) {
      if (!has_block_ && !(has_block_ = pipeline_->next(block_))) ended_ = true;
      if (!has_block_ || !queue_.push(block_)) break;
      has_block_ = false;
    }
  }

  std::mt19937_64 rng_;
  std::uniform_int_distribution<int> late_for_{0, 60};
  Assembly assembly_;
  InlineRatePlans inline_plans_;
  LoopbackDrives drives_;
  MotionQueue queue_;
  Cycle cycle_;
  SessionLog log_;
  Parameters parameters_;
  ToolTable tools_;
  std::optional<Pipeline> pipeline_;
  MotionBlock block_;
  bool ended_ = true, has_block_ = false;
  std::uint32_t id_ = 0;
  SessionRows rows_;
};

/// Replays the session on a machine assembled anew.
inline void expect_same_bits(const SessionBench& bench, std::uint64_t seed, const std::string& config) {
  const Session session = read_session(SessionBench::log_path());
  const Assembly assembly = assemble(config);
  Parameters parameters;
  ToolTable tools;
  SessionRows again;
  replay(session, assembly, parameters, tools, again);
  ASSERT_FALSE(again.q.empty());
  ASSERT_LT(again.q.size(), bench.rows().size() + 100'000) << "goes on though nothing moves any more";
  for (std::size_t i = 0; i < bench.rows().size(); ++i) {
    // A replay ends when nothing is left to do; the machine of the session stood on.
    const JointVec& q = again.q[std::min(i, again.q.size() - 1)];
    ASSERT_EQ(q, bench.rows()[i]) << "seed " << seed << " row " << i;
  }
}

}  // namespace trn
