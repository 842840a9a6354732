#include "kernel/cycle.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <random>
#include <set>
#include <sstream>

#include "app/check/limit_judge.h"
#include "app/check/trace_reader.h"
#include "app/session/assembly.h"
#include "app/session/make_cycle.h"
#include "app/session/pipeline.h"
#include "core/config.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "tests/support/allocation_counter.h"
#include "tests/support/paths.h"
#include "tests/support/program_words.h"
#include "tests/support/rounds.h"

namespace trn {
namespace {

// So few that the test of lost reports loses some.
CycleConfig few_reports(CycleConfig config) {
  config.report_capacity = 8;
  return config;
}

/// A machine with a program in front of its tick.
class Bench {
 public:
  Bench(const std::string& config, const std::string& program)
      : assembly_(assemble(config)),
        queue_(1 << 14),
        cycle_(few_reports(cycle_config(assembly_, ProgramStops::kPass)),
               {*assembly_.map, queue_, *assembly_.drives, *assembly_.rate_plans,
                assembly_.corrections.setpoint.get()}) {
    assembly_.drives->bring_up();
    for (int i = 0; i < 20000 && cycle_.last_report().drives != DriveState::kEnabled; ++i) cycle_.tick();
    start(program);
  }
  void start(const std::string& program) {
    pipeline_.emplace(assembly_, parameters_, tools_,
                      ProgramStart{"test", program, cycle_.last_report().q_plan}, PipelineObservers{});
    ended_ = false;
    fill();
    cycle_.post({RtCommand::Kind::kStart});
  }
  void fill() {
    while (!ended_ && queue_.buffered_s() < assembly_.planner.buffer_s) {
      if (!pipeline_->next(block_)) ended_ = true;
      if (!ended_) queue_.push(block_);
    }
  }
  Cycle& cycle() { return cycle_; }
  const CycleReport& report() const { return cycle_.last_report(); }
  const Assembly& assembly() const { return assembly_; }

 private:
  Assembly assembly_;
  Parameters parameters_;
  ToolTable tools_;
  MotionQueue queue_;
  Cycle cycle_;
  std::optional<Pipeline> pipeline_;
  MotionBlock block_;
  bool ended_ = false;
};

/// Small moves of every word the machine obeys, around where it stands, without end.
std::string wander(const Assembly& assembly) {
  std::string program = "G21 G94 G64 P0.02\nG91\n";
  const unsigned mask = program_words(assembly);
  for (int round = 0; round < 40; ++round) {
    const int sign = round % 2 ? -1 : 1;
    for (int k = 0; k < 6; ++k) {
      if (!(mask >> k & 1)) continue;
      program += std::string("G1 F3000 ") + kWordLetters[k] + std::to_string(sign * (k < 3 ? 7.5 : 1.5));
      program += "\n";
    }
  }
  return program + "M2\n";
}

class EveryConfig : public testing::TestWithParam<std::string> {};

TEST_P(EveryConfig, TheTickNeverAllocates) {
  const Assembly probe = assemble(GetParam());
  Bench bench(GetParam(), wander(probe));
  if (allocation_count() < 0) GTEST_SKIP() << "allocations cannot be counted here";
  long counted = 0;
  int moving = 0;
  for (int i = 0; i < 100000; ++i) {
    bench.fill();
    if (bench.report().motion == MotionState::kRest && i > 5) bench.start(wander(probe));
    const long before = allocation_count();
    bench.cycle().tick();
    counted += allocation_count() - before;
    moving += bench.report().motion == MotionState::kMoving;
    ASSERT_EQ(bench.report().fault, Fault::kOk) << "period " << i;
  }
  EXPECT_EQ(counted, 0);
  EXPECT_GT(moving, 90000);
}

// The plan runs, the setpoints stay; unlocked, the next program begins where the joints have stood.
TEST_P(EveryConfig, LockedNothingMoves) {
  const Assembly probe = assemble(GetParam());
  Bench bench(GetParam(), "G4 P0.01\nM2\n");
  const auto rest = [&] {
    for (int i = 0; i < 200000; ++i) {
      bench.fill();
      bench.cycle().tick();
      if (i > 2 && bench.report().motion == MotionState::kRest) return;
    }
    FAIL() << "it never rests";
  };
  rest();
  for (int i = 0; i < 100; ++i) bench.cycle().tick();
  const JointVec stands = bench.report().q_setpoint, plan = bench.report().q_plan;
  bench.cycle().post({RtCommand::Kind::kMachineLock, 1});
  bench.cycle().tick();
  EXPECT_TRUE(bench.report().machine_lock);
  bench.start(wander(probe));
  double farthest = 0;
  for (int i = 0; i < 3000; ++i) {
    bench.fill();
    bench.cycle().tick();
    ASSERT_EQ(bench.report().q_setpoint, stands) << "period " << i;
    farthest = std::max(farthest, (bench.report().q_plan - plan).lpNorm<Eigen::Infinity>());
    if (i == 1000) bench.cycle().post({RtCommand::Kind::kMachineLock, 0});  // not while it moves
    EXPECT_TRUE(bench.report().machine_lock);
  }
  EXPECT_GT(farthest, 0.1) << "the program ran";
  bench.cycle().post({RtCommand::Kind::kStop});
  rest();
  bench.cycle().post({RtCommand::Kind::kMachineLock, 0});
  bench.cycle().tick();
  EXPECT_FALSE(bench.report().machine_lock);
  EXPECT_LT((bench.report().q_setpoint - stands).lpNorm<Eigen::Infinity>(), 1e-3) << "but for corrections";
  EXPECT_LT((bench.report().q_plan - plan).lpNorm<Eigen::Infinity>(), 1e-3);
  EXPECT_EQ(bench.report().fault, Fault::kOk);
}

// Override, hold, resume and stop at any tick: an independent judge looks at the setpoints.
TEST_P(EveryConfig, OperatorEventsNeverBreakALimit) {
  const Assembly probe = assemble(GetParam());
  const int scenarios = test::rounds(3, 100);
  for (int scenario = 0; scenario < scenarios; ++scenario) {
    std::mt19937_64 rng(static_cast<std::uint64_t>(scenario) + 1);
    std::uniform_int_distribution<int> wait(1, 900), kind(0, 5);
    std::uniform_real_distribution<double> override_value(0, 2);
    Bench bench(GetParam(), wander(probe));
    const Joints& joints = bench.assembly().machine.joints;
    LimitJudge judge(joints, bench.assembly().machine.period_s);
    TraceRow row;
    int next = wait(rng), planner_sleeps = 0;
    const auto judge_row = [&](int period) {
      const JointVec& q = bench.report().q_setpoint;
      row.t_s = period * bench.assembly().machine.period_s;
      row.q.assign(q.data(), q.data() + q.size());
      row.digits.assign(row.q.size(), WrittenDigits{17, 17});
      judge.row(row);
    };
    judge_row(0);
    for (int i = 1; i <= 6000; ++i) {
      if (--planner_sleeps < 0) bench.fill();
      if (--next == 0) {
        if (kind(rng) == 0) planner_sleeps = 3 * wait(rng);
        next = wait(rng);
        using Kind = RtCommand::Kind;
        const Kind kinds[] = {Kind::kHold,     Kind::kResume, Kind::kOverride,
                              Kind::kOverride, Kind::kStop,   Kind::kResume};
        const Kind chosen = kinds[kind(rng)];
        bench.cycle().post({chosen, override_value(rng)});
      }
      if (bench.report().motion == MotionState::kRest && i > 5) bench.start(wander(probe));
      bench.cycle().tick();
      ASSERT_EQ(bench.report().fault, Fault::kOk) << "scenario " << scenario << " period " << i;
      judge_row(i);
    }
    for (std::size_t k = 0; k < joints.size(); ++k)
      for (const Quantity quantity : {Quantity::kVelocity, Quantity::kAcceleration, Quantity::kJerk})
        EXPECT_LE(judge.verdicts()[k].peak(quantity).ratio, LimitJudge::kRatioMax)
            << "scenario " << scenario << " " << joints[k].name << " " << to_string(quantity) << " at "
            << judge.verdicts()[k].peak(quantity).t_s;
  }
}

TEST_P(EveryConfig, EmergencyStopIsLatchedUntilItIsReset) {
  const Assembly probe = assemble(GetParam());
  Bench bench(GetParam(), wander(probe));
  for (int i = 0; i < 200; ++i) bench.cycle().tick();
  EXPECT_EQ(bench.report().motion, MotionState::kMoving);
  bench.cycle().post({RtCommand::Kind::kEmergencyStop});
  for (int i = 0; i < 50; ++i) bench.cycle().tick();
  EXPECT_EQ(bench.report().fault, Fault::kEmergencyStop);
  EXPECT_EQ(bench.report().motion, MotionState::kRest);
  bench.cycle().post({RtCommand::Kind::kStart});
  bench.cycle().tick();
  EXPECT_EQ(bench.report().motion, MotionState::kRest) << "a latched fault forbids motion";
  bench.cycle().post({RtCommand::Kind::kResetFault});
  bench.cycle().tick();
  EXPECT_EQ(bench.report().fault, Fault::kOk);
}

// Whose program has yet to be planned.
TEST_P(EveryConfig, AStartShowsNoLineOfTheProgramBefore) {
  Bench bench(GetParam(), "\n\nG4 P0.01\nM2\n");
  for (int i = 0; i < 1000; ++i) bench.cycle().tick();
  ASSERT_EQ(bench.report().motion, MotionState::kRest);
  ASSERT_EQ(bench.report().line, 4u) << "where it ended";
  bench.cycle().post({RtCommand::Kind::kStart});
  bench.cycle().tick();
  EXPECT_EQ(bench.report().motion, MotionState::kMoving);
  EXPECT_EQ(bench.report().line, 0u);
  EXPECT_EQ(bench.report().step, 0u);
}

TEST_P(EveryConfig, ReportsThatNobodyTakesAreCounted) {
  Bench bench(GetParam(), wander(assemble(GetParam())));
  for (int i = 0; i < 20; ++i) bench.cycle().tick();  // now the ring is full
  const auto before = bench.report().lost_reports;
  for (int i = 0; i < 100; ++i) bench.cycle().tick();
  EXPECT_EQ(bench.report().lost_reports, before + 100);
}

// Without one of these another rule fails before the misspelt key is met: the bus is too slow, the data sheet
// tells too little, a joint needs a range, the motors of a gantry differ, a clamped axis looks for its joint.
const std::set<std::string> kNeededElsewhere = {
    "data_bitrate", "rated_force_N", "rated_torque_Nm", "endless", "home_final_mm", "home_group", "tilt_deg"};

// Every key of every shipped config, misspelt: refused at its line, with the right spelling named.
TEST_P(EveryConfig, EveryMisspeltKeyIsRefusedWithTheLegalOne) {
  std::ifstream in(GetParam());
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  const std::string folder = testing::TempDir() + "misspelt/";  // files that a config names lie beside it
  std::filesystem::copy(
      source_dir() + "/configs", folder,
      std::filesystem::copy_options::recursive | std::filesystem::copy_options::overwrite_existing);
  int keys = 0;
  for (std::size_t n = 0; n < lines.size(); ++n) {
    const std::size_t equals = lines[n].find(" = ");
    if (equals == std::string::npos || lines[n][0] == '#') continue;
    const std::string key = lines[n].substr(0, equals);
    if (key.size() < 3) continue;
    ++keys;
    std::vector<std::string> damaged = lines;
    damaged[n] = key + "q" + lines[n].substr(equals);
    const std::string path = folder + "misspelt.toml";
    {
      std::ofstream out(path);
      for (const std::string& line : damaged) out << line << '\n';
    }
    try {
      assemble(path);
      ADD_FAILURE() << GetParam() << ":" << n + 1 << ": accepted '" << key << "q'";
    } catch (const ConfigError& error) {
      const std::string message = error.what();
      if (kNeededElsewhere.contains(key)) continue;
      EXPECT_NE(message.find(":" + std::to_string(n + 1) + ":"), std::string::npos) << key << ": " << message;
      EXPECT_NE(message.find("'" + key + "'"), std::string::npos) << key << ": " << message;
    }
  }
  EXPECT_GT(keys, 20);
}

INSTANTIATE_TEST_SUITE_P(Configs, EveryConfig, testing::ValuesIn(shipped_configs()), [](const auto& config) {
  return std::filesystem::path(config.param).stem().string();
});

}  // namespace
}  // namespace trn
