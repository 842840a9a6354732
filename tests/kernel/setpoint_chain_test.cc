#include "kernel/setpoint_chain.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "app/check/limit_judge.h"
#include "app/check/trace_reader.h"
#include "app/session/assembly.h"
#include "app/session/make_cycle.h"
#include "app/session/pipeline.h"
#include "core/fault.h"
#include "core/motion.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"
#include "tests/support/paths.h"

// Corrections behind the plan, whatever they ask for, keep every joint inside the machine's limits.
namespace trn {
namespace {

/// Asks for jumps, noise and nonsense.
class Wild final : public SetpointCorrection {
 public:
  explicit Wild(unsigned seed) : random_(seed) {}
  void wanted(const CorrectionInput&, JointVec& offset) TRN_RT override {
    if (++period_ % 137 == 0) level_ = uniform_(random_);
    for (double& value : offset) value = 3 * level_ + 0.1 * uniform_(random_);
    if (period_ % 1001 == 0) offset[0] = std::nan("");
  }
  unsigned joint_mask() const override { return 0b11111; }

 private:
  std::mt19937 random_;
  std::uniform_real_distribution<double> uniform_{-1, 1};
  int period_ = 0;
  double level_ = 0;
};

/// Grows with the position, as a warm ball screw does.
class Growth final : public SetpointCorrection {
 public:
  void wanted(const CorrectionInput& input, JointVec& offset) TRN_RT override {
    for (int i = 0; i < 3; ++i) offset[i] = kSlope * input.q[i];
  }
  unsigned joint_mask() const override { return 0b00111; }
  double slope_max() const TRN_RT override { return kSlope; }
  static constexpr double kSlope = 1e-3;
};

constexpr char kProgram[] =
    "G21 G94 G64 P0.02\nG91\nM428\n"
    "G0 X150 Y-120 Z60\nG1 X-150 Y120 A40 C90 F30000\nG1 X40 A-60 C-200\nG0 X-90 Z-40\nG1 X30 Y40 A20 "
    "C110\nM2\n";

struct Outcome {
  bool within_limits = false;
  double largest = 0;  ///< offset seen, mm
  double velocity = 0, jerk = 0;
};

Outcome run(SetpointChain& chain, Assembly& assembly, bool switch_often) {
  MotionQueue queue(1 << 14);
  CycleConfig config = cycle_config(assembly, ProgramStops::kPass);
  config.plan_joints = chain.plan_joints();
  Cycle cycle(config, {*assembly.map, queue, *assembly.drives, *assembly.rate_plans, &chain});
  assembly.plan_joints = chain.plan_joints();
  // Judged from the first tick on, when nothing has moved.
  LimitJudge judge(assembly.machine.joints, assembly.machine.period_s);
  TraceRow row;
  const auto tick = [&] {
    cycle.tick();
    const JointVec& q = cycle.last_report().q_setpoint;
    row.t_s += assembly.machine.period_s;
    row.q.assign(q.data(), q.data() + 5);
    row.digits.assign(5, WrittenDigits{17, 17});
    judge.row(row);
  };
  assembly.drives->bring_up();
  while (cycle.last_report().drives != DriveState::kEnabled) tick();
  Parameters parameters;
  ToolTable tools;
  Pipeline pipeline(assembly, parameters, tools, {"test", kProgram, cycle.last_report().q_plan}, {});
  MotionBlock block;
  while (pipeline.next(block)) queue.push(block);
  cycle.post({RtCommand::Kind::kStart});
  Outcome out;
  bool ended = false;
  for (int i = 0, still = 0; i < 30000 && still < 3000; ++i) {
    ended |= i > 10 && cycle.last_report().motion == MotionState::kRest;
    still += ended ? 1 : 0;  // what is left of the offsets fades
    if (still == 1) cycle.post({RtCommand::Kind::kCorrection, 0, 0, 0});
    if (switch_often && !ended && i % 700 == 0)
      cycle.post({RtCommand::Kind::kCorrection, i % 1400 == 0 ? 0.0 : 1.0, 0, 0});
    tick();
    const CycleReport& report = cycle.last_report();
    EXPECT_EQ(report.fault, Fault::kOk);
    out.largest = std::max(out.largest, std::abs(report.corrections[0].offset[0]));
  }
  judge.finish();
  out.within_limits = judge.within_limits();
  for (const JointVerdict& v : judge.verdicts()) {
    out.velocity = std::max(out.velocity, v.peak(Quantity::kVelocity).ratio);
    out.jerk = std::max(out.jerk, v.peak(Quantity::kJerk).ratio);
  }
  return out;
}

TEST(SetpointChain, WildOffsetsKeepTheLimits) {
  Assembly assembly = assemble(source_dir() + "/configs/cradle.toml");
  SetpointChain chain(assembly.machine.joints, assembly.machine.period_s);
  chain.append({"wild", true, 0.1, 1e-4, 0.01}, std::make_unique<Wild>(1));
  const Outcome out = run(chain, assembly, true);
  EXPECT_TRUE(out.within_limits) << out.velocity << " " << out.jerk;
  EXPECT_GT(out.largest, 0.05);
  EXPECT_GT(out.jerk, 0.9);  // the plan does use what is left
}

TEST(SetpointChain, OffsetsThatGrowWithThePositionKeepTheLimits) {
  Assembly assembly = assemble(source_dir() + "/configs/cradle.toml");
  SetpointChain chain(assembly.machine.joints, assembly.machine.period_s);
  chain.append({"growth", true, 0.5, 1e-4, 0.005}, std::make_unique<Growth>());
  const Outcome steady = run(chain, assembly, false);
  EXPECT_TRUE(steady.within_limits);
  EXPECT_GT(steady.largest, 0.1);
}

TEST(SetpointChain, SwitchingInMotionKeepsTheLimits) {
  Assembly assembly = assemble(source_dir() + "/configs/cradle.toml");
  SetpointChain chain(assembly.machine.joints, assembly.machine.period_s);
  chain.append({"growth", true, 0.5, 1e-4, 0.005}, std::make_unique<Growth>());
  EXPECT_TRUE(run(chain, assembly, true).within_limits);
}

TEST(SetpointChain, ThePlannerKeepsTheReserveFree) {
  const Assembly assembly = assemble(source_dir() + "/configs/cradle.toml");
  SetpointChain chain(assembly.machine.joints, assembly.machine.period_s);
  chain.append({"growth", true, 0.5, 1e-4, 0.005}, std::make_unique<Growth>());
  const JointLimit& all = assembly.machine.joints[0].limit;
  const Joints plan_joints = chain.plan_joints();
  const JointLimit& plan = plan_joints[0].limit;
  EXPECT_DOUBLE_EQ(plan.velocity, all.velocity * (1 - 0.005 - Growth::kSlope));
  EXPECT_DOUBLE_EQ(plan.jerk, all.jerk * (1 - 0.005 - Growth::kSlope));
  EXPECT_DOUBLE_EQ(plan.max, all.max - 0.5);
  EXPECT_DOUBLE_EQ(plan_joints[3].limit.velocity, assembly.machine.joints[3].limit.velocity);
}

}  // namespace
}  // namespace trn
