// The tick: its distribution over a five-axis program, and planning beside it.
//   bench_cycle
//   valgrind --tool=callgrind --toggle-collect='trn::Cycle::tick()' bench_cycle --benchmark_min_time=0.001
//   (instructions collected / ticks reported = instructions per tick)
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <sstream>

#include "app/session/assembly.h"
#include "app/session/corrections.h"
#include "app/session/make_cycle.h"
#include "app/session/pipeline.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/machine.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/cycle.h"
#include "kernel/joint_map.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"
#include "kinematics/factory.h"
#include "tests/support/paths.h"

namespace trn {
namespace {

constexpr int kTicks = 20000;

/// What the operator does in every period.
using Operator = void (*)(Cycle&, int tick);

void nobody(Cycle&, int) {}
void sweeps_override(Cycle& cycle, int tick) {
  if (tick % 50 == 0) cycle.post({RtCommand::Kind::kOverride, 1 + std::sin(0.001 * tick)});
}
void holds(Cycle& cycle, int tick) {
  if (tick % 300 == 100) cycle.post({RtCommand::Kind::kHold});
  if (tick % 300 == 250) cycle.post({RtCommand::Kind::kResume});
}
void steps(Cycle& cycle, int tick) {
  if (tick == 0) cycle.post({RtCommand::Kind::kSingleBlock, 1});
  if (cycle.last_report().motion == MotionState::kPaused) cycle.post({RtCommand::Kind::kResume});
}

/// Lines of 10 to 40 mm with blends between them, three axes.
std::string zigzag_text() {
  std::ostringstream text;
  text << "G21 G90 G94 G64 P0.02\nF6000\n";
  for (int i = 0; i < 300; ++i) text << "G1 X" << 7 * i % 40 << " Y" << 3 * i % 20 << "\n";
  return text.str() + "M2\n";
}

void ticks(benchmark::State& state, Operator acts, const std::string& config,
           const std::optional<std::string>& text) {
  const std::string source = source_dir();
  std::vector<double> ns;
  for (auto _ : state) {
    Assembly assembly = assemble(source + "/configs/" + config);
    Parameters parameters;
    ToolTable tools = ToolTable::load(source + "/examples/tools.tbl");
    MotionQueue queue(1 << 14);
    Cycle cycle =
        make_cycle(assembly, queue, ProgramStops::kPass, *assembly.drives, nullptr, *assembly.rate_plans);
    assembly.drives->bring_up();
    while (cycle.last_report().drives != DriveState::kEnabled) cycle.tick();
    Pipeline pipeline(assembly, parameters, tools,
                      {source + "/examples/impeller.ngc", text, cycle.last_report().q_plan}, {});
    cycle.post({RtCommand::Kind::kStart});
    MotionBlock block;
    int moving = 0;
    for (int i = 0; i < kTicks; ++i) {
      ProgramAnswer answer;  // a change of tools asks whether the tool is in
      if (pipeline.waiting() && queue.take_answer(answer)) pipeline.answer(answer);
      while (queue.buffered_s() < assembly.planner.buffer_s && pipeline.next(block)) queue.push(block);
      acts(cycle, i);
      const auto start = std::chrono::steady_clock::now();
      cycle.tick();
      ns.push_back(
          std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count());
      moving += cycle.last_report().speed_mm_s > 0;
    }
    if (moving < kTicks / 4) state.SkipWithError("the machine stands: these are no ticks of a motion");
  }
  std::sort(ns.begin(), ns.end());
  const auto at = [&](double share) {
    return ns[static_cast<std::size_t>(share * static_cast<double>(ns.size() - 1))];
  };
  state.counters["ticks"] = static_cast<double>(ns.size());
  state.counters["p50_ns"] = at(0.5);
  state.counters["p99_9_ns"] = at(0.999);
  state.counters["max_ns"] = ns.back();
}

void impeller(benchmark::State& state, Operator acts) { ticks(state, acts, "cradle.toml", std::nullopt); }
void zigzag(benchmark::State& state, Operator acts) { ticks(state, acts, "mill.toml", zigzag_text()); }
BENCHMARK_CAPTURE(impeller, ticks, nobody)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(impeller, ticks_override_sweep, sweeps_override)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(impeller, ticks_hold, holds)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(impeller, ticks_single_block, steps)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(zigzag, ticks, nobody)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(zigzag, ticks_override_sweep, sweeps_override)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(zigzag, ticks_hold, holds)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(zigzag, ticks_single_block, steps)->Unit(benchmark::kMillisecond);

/// A config with further sections at its end.
ConfigTable extended(const std::string& name, const std::string& more) {
  std::ifstream in(source_dir() + "/configs/" + name + ".toml");
  std::stringstream text;
  text << in.rdbuf() << more;
  return parse_config(text.str(), name);
}

/// The joint map of the cradle, without corrections, with geometric errors, with joint tables.
void joint_map(benchmark::State& state, const std::string& config, const std::string& more) {
  const Machine machine = read_machine(extended(config, more));
  const auto kinematics = make_kinematics(machine);
  const Corrections corrections = read_corrections(machine);
  const MachineJointMap map(*kinematics, corrections.pose.get(), corrections.joint.get());
  MapContext context;
  context.rtcp = true;
  context.tool_offset = {0, 0, 100};
  Words y = Words::Zero();
  y << 30, -20, 40, 0.4, 0, 1.1;
  JointVec q;
  for (auto _ : state) {
    y[kX] += 1e-9;
    benchmark::DoNotOptimize(map.map(y, context, q));
    benchmark::DoNotOptimize(q);
  }
}
constexpr char kTables[] = R"(
[corrections.joint_table]
[[corrections.joint_table.joint]]
joint = "X"
at_mm = [-400, -200, 0, 200, 400]
forward_mm = [0.01, 0.02, 0.0, -0.01, 0.01]
backward_mm = [0.02, 0.03, 0.01, 0.0, 0.02]
[[corrections.joint_table.joint]]
joint = "Y"
slope = 0.0003
backlash_mm = 0.01
)";
constexpr char kScrew[] = R"(
[corrections.screw]
[[corrections.screw.axis]]
joint = "X"
mounting = "fixed-free"
fixed_bearing_mm = -450
far_bearing_mm = 450
)";
BENCHMARK_CAPTURE(joint_map, without_corrections, "cradle", "");
BENCHMARK_CAPTURE(joint_map, with_geometric, "cradle_measured", "");
BENCHMARK_CAPTURE(joint_map, with_joint_table, "cradle", kTables);

/// One period of what stands behind the plan.
void chain_step(benchmark::State& state, const std::string& more) {
  const Machine machine = read_machine(extended("cradle", more));
  const Corrections corrections = read_corrections(machine);
  JointVec q = JointVec::Zero(5);
  Feedback feedback;
  feedback.q = q;
  for (auto _ : state) {
    q[0] = q[0] > 100 ? -100 : q[0] + 0.01;
    corrections.setpoint->step({q, feedback});
    benchmark::DoNotOptimize(corrections.setpoint->offset());
  }
}
BENCHMARK_CAPTURE(chain_step, backlash, kTables);
BENCHMARK_CAPTURE(chain_step, one_screw, kScrew);

}  // namespace
}  // namespace trn

BENCHMARK_MAIN();
