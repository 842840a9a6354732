// What the tick costs while a person or a late planner changes the motion: every shipped config, in five
// modes. The drives are a loopback, so that no simulated plant is counted, and the rate plans are made
// between the ticks, as the daemon's thread makes them beside them.
//   bench_tick --benchmark_filter=cradle/    (TRN_LONG=100000: so many ticks; TRN_PERIOD_US=250: of this
//   period, where the config's field bus can carry it)
//   python3 bench/tick_table.py build/release/bench_tick         (instructions, by callgrind)
#include <benchmark/benchmark.h>
#include <sys/mman.h>
#include <time.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include "app/daemon/rate_planner_thread.h"
#include "app/session/assembly.h"
#include "app/session/make_cycle.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/motion.h"
#include "hal/loopback.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"
#include "tests/kernel/planned_motion.h"
#include "tests/support/paths.h"
#include "tests/support/program_words.h"

namespace trn {
namespace {

enum class Mode { kPlanned, kOverride, kHolds, kSingleBlock, kLatePlanner };

/// Blended strokes of every word around the middle, and back.
std::string strokes(const Assembly& assembly) {
  std::mt19937_64 rng(1);
  std::uniform_real_distribution<double> u(-1, 1);
  const unsigned mask = program_words(assembly);
  std::string program = "G21 G94 G64 P0.02\nG91\n";
  Words at = Words::Zero();
  constexpr int kStrokes = 60;
  for (int i = 0; i <= kStrokes; ++i) {
    program += i % 3 ? "G1 F6000" : "G1 F1500";
    for (int k = 0; k < 6; ++k) {
      if (!(mask >> k & 1)) continue;
      const double to = i == kStrokes ? 0 : (k < 3 ? 12 : 2.5) * u(rng);
      program += std::string(" ") + kWordLetters[k] + std::to_string(to - at[k]);
      at[k] = to;
    }
    program += "\n";
  }
  return program + "M2\n";
}

void act(Mode mode, Cycle& cycle, int tick) {
  using Kind = RtCommand::Kind;
  const MotionState motion = cycle.last_report().motion;
  if (motion == MotionState::kRest) cycle.post({Kind::kStart});
  if (motion == MotionState::kPaused) cycle.post({Kind::kResume});
  if (mode == Mode::kOverride && tick % 50 == 0) cycle.post({Kind::kOverride, 1 + std::sin(0.001 * tick)});
  if (mode == Mode::kHolds && tick % 300 == 100) cycle.post({Kind::kHold});
  if (mode == Mode::kHolds && tick % 300 == 250) cycle.post({Kind::kResume});
  if (mode == Mode::kSingleBlock && tick == 0) cycle.post({Kind::kSingleBlock, 1});
}

/// Of this thread's own work, whatever the host does beside it, ns.
double cpu_ns() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e9 * static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec);
}

double since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count();
}

double share_of(std::vector<double>& values, double share) {
  std::sort(values.begin(), values.end());
  return values.empty() ? 0
                        : values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

void ticks(benchmark::State& state, const std::string& config, Mode mode) {
  const char* const count = std::getenv("TRN_LONG");
  const int most = count ? std::atoi(count) : 1000;
  const char* const period_us = std::getenv("TRN_PERIOD_US");
  const std::string program = strokes(assemble(config));
  std::optional<PlannedMotion> planned;
  try {
    planned.emplace(config, program, period_us ? std::atof(period_us) * 1e-6 : 0);
  } catch (const ConfigError& error) {  // a field bus that cannot carry its drives so often
    state.SkipWithError(std::string(error.what()).substr(0, 120).c_str());
    return;
  }
  const PlannedMotion& motion = *planned;
  const Assembly& assembly = motion.assembly();
  const double period_s = assembly.machine.period_s;
  std::vector<double> ns, cpu_of_tick_ns, answer_ns;
  for (auto* const times : {&ns, &cpu_of_tick_ns, &answer_ns}) times->reserve(static_cast<std::size_t>(most));
  int overruns = 0, moving = 0;
  for (auto _ : state) {
    MotionQueue queue(1 << 13);
    RatePlannerThread plans(assembly.plan_joints, period_s);  // without a thread: it works between the ticks
    LoopbackDrives drives(motion.q(0));
    Cycle cycle = make_cycle(assembly, queue, ProgramStops::kPass, drives, nullptr, plans);
    cycle.tick();
    drives.bring_up();
    for (int i = 0; i < 3; ++i) cycle.tick();
    std::size_t next = 0;
    double fed_s = 0.4;
    for (int i = 0; i < most; ++i) {
      // A late planner is half as fast as the motion.
      fed_s += 0.5 * period_s;
      while (queue.buffered_s() < assembly.planner.buffer_s) {
        const MotionBlock& block = motion.blocks()[next];
        if (mode == Mode::kLatePlanner && fed_s < 0) break;
        if (!queue.push(block)) break;
        for (int k = 0; k < block.segment_count; ++k)
          fed_s -= block.segments[static_cast<std::size_t>(k)].duration_s;
        next = (next + 1) % motion.blocks().size();
      }
      act(mode, cycle, i);
      const double cpu = cpu_ns();
      const auto start = std::chrono::steady_clock::now();
      cycle.tick();
      ns.push_back(since(start));
      cpu_of_tick_ns.push_back(cpu_ns() - cpu);
      overruns += cpu_of_tick_ns.back() > 1e9 * period_s;
      const auto asked = std::chrono::steady_clock::now();
      if (plans.work()) answer_ns.push_back(since(asked));
      moving += cycle.last_report().speed_mm_s > 0;
    }
    if (moving < most / 8) state.SkipWithError("the machine stands: these are no ticks of a motion");
  }
  state.counters["ticks"] = static_cast<double>(ns.size());
  state.counters["p50_ns"] = share_of(ns, 0.5);
  state.counters["p99_9_ns"] = share_of(ns, 0.999);
  state.counters["max_ns"] = share_of(ns, 1);
  state.counters["cpu_p99_9_ns"] = share_of(cpu_of_tick_ns, 0.999);  // without what the host did between
  state.counters["cpu_max_ns"] = share_of(cpu_of_tick_ns, 1);
  state.counters["moving"] = static_cast<double>(moving) / most;
  state.counters["overruns"] = overruns;  // ticks whose own work was longer than a period
  state.counters["answers"] = static_cast<double>(answer_ns.size());
  state.counters["answer_p50_ns"] = share_of(answer_ns, 0.5);
  state.counters["answer_max_ns"] = share_of(answer_ns, 1);
}

}  // namespace
}  // namespace trn

int main(int argc, char** argv) {
  using trn::Mode;
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0)  // as the daemon's is
    std::fputs("bench_tick: memory is not locked; the first ticks read their pages in\n", stderr);
  const std::pair<const char*, Mode> modes[] = {{"planned", Mode::kPlanned},
                                                {"override", Mode::kOverride},
                                                {"holds", Mode::kHolds},
                                                {"single_block", Mode::kSingleBlock},
                                                {"late_planner", Mode::kLatePlanner}};
  for (const std::string& config : trn::shipped_configs())
    for (const auto& [name, mode] : modes)
      benchmark::RegisterBenchmark(
          (std::filesystem::path(config).stem().string() + "/" + name).c_str(),
          [config, mode = mode](benchmark::State& state) { trn::ticks(state, config, mode); })
          ->Iterations(1)
          ->Unit(benchmark::kMillisecond);
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 1;
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
