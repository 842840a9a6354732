#include "app/session/program_time.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "app/session/make_cycle.h"
#include "app/session/pipeline.h"
#include "app/session/plan_time.h"
#include "app/session/program_progress.h"
#include "app/session/program_step.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rt_messages.h"
#include "tests/support/paths.h"

// How long a program takes, and how long it still takes, against the tick that drives it.
namespace trn {
namespace {

/// A program as the daemon drives it, in one thread and without a clock.
class TimedRun {
 public:
  /// What was promised in one period.
  struct Promise {
    double left_s = 0, done_s = 0;
  };
  struct Change {
    double time_s;
    RtCommand::Kind kind;
    double share;
  };

  static constexpr double kMax_s = 1000;

  explicit TimedRun(const std::string& program)
      : path_(source_dir() + "/examples/" + program),
        assembly_(assemble(source_dir() + "/configs/cradle.toml")),
        tools_(ToolTable::load(source_dir() + "/examples/tools.tbl")),
        queue_(1 << 14),
        cycle_(make_cycle(assembly_, queue_, ProgramStops::kPass)),
        progress_(assembly_.machine.period_s) {}

  /// Every period's promise, up to the program's end.
  std::vector<Promise> run(std::vector<Change> changes) {
    stand_ready();
    start_ = {path_, std::nullopt, cycle_.last_report().q_plan};
    start_.switches = ProgramSwitches::of(assembly_);
    progress_.begin();
    progress_.set_total(time_program(assembly_, parameters_, tools_, start_));
    PipelineObservers observers;
    observers.steps = true;
    Pipeline pipeline(assembly_, parameters_, tools_, start_, observers);
    cycle_.post({RtCommand::Kind::kStart});
    std::vector<Promise> promises;
    while (time_s(promises) < kMax_s) {
      fill(pipeline);
      for (; !changes.empty() && time_s(promises) >= changes.front().time_s; changes.erase(changes.begin()))
        change(changes.front());
      cycle_.tick();
      const CycleReport& report = cycle_.last_report();
      progress_.report(report, step_of(report), shares_);
      if (report.event.kind == QueueEvent::Kind::kProgramEnd) break;
      promises.push_back({progress_.left_s(), progress_.done_s()});
    }
    EXPECT_LT(time_s(promises), kMax_s) << "it never ends";
    return promises;
  }
  double time_s(const std::vector<Promise>& promises) const {
    return static_cast<double>(promises.size()) * assembly_.machine.period_s;
  }
  double total_s() const { return progress_.total_s(); }

 private:
  void stand_ready() {
    assembly_.drives->bring_up();
    for (int i = 0; i < 20000 && cycle_.last_report().drives != DriveState::kEnabled; ++i) cycle_.tick();
  }
  void fill(Pipeline& pipeline) {
    while (queue_.buffered_s() < 1) {
      ProgramAnswer answer;
      if (pipeline.waiting()) {
        if (!queue_.take_answer(answer)) return;
        pipeline.answer(answer);
      }
      MotionBlock block;
      if (!pipeline.next(block)) {
        if (pipeline.waiting()) continue;
        return;
      }
      if (pipeline.step()) steps_.push_back(*pipeline.step());
      ASSERT_TRUE(queue_.push(block));
    }
  }
  void change(const Change& change) {
    cycle_.post({change.kind, change.share});
    (change.kind == RtCommand::Kind::kRapidOverride ? shares_.rapid : shares_.feed) = change.share;
  }
  // As ProgramProcess::step.
  const ProgramStep* step_of(const CycleReport& report) {
    for (; !steps_.empty() && steps_.front().source.step <= report.step; steps_.pop_front())
      step_ = steps_.front();
    return step_.source.step > 0 && report.motion != MotionState::kRest ? &step_ : nullptr;
  }

  std::string path_;
  Assembly assembly_;
  Parameters parameters_;
  ToolTable tools_;
  MotionQueue queue_;
  Cycle cycle_;
  ProgramProgress progress_;
  ProgramStart start_;
  std::deque<ProgramStep> steps_;
  ProgramStep step_;
  OverrideShares shares_;
};

/// The greatest error of what was promised, as a share of the whole time, from `from` to `to` (shares of it).
double worst_error(const std::vector<TimedRun::Promise>& promises, double from, double to) {
  const auto n = static_cast<double>(promises.size());
  double worst = 0;
  for (auto i = static_cast<std::size_t>(from * n); i < static_cast<std::size_t>(to * n); ++i) {
    const double real_s = 1e-3 * (n - static_cast<double>(i));
    worst = std::max(worst, std::abs(promises[i].left_s - real_s) / (1e-3 * n));
  }
  return worst;
}

constexpr double kSeen_s = 1;

struct Case {
  const char *program, *name;
  RtCommand::Kind kind;
  double share;
};

constexpr Case kCases[] = {
    {"impeller.ngc", "none", RtCommand::Kind::kOverride, 1},
    {"impeller.ngc", "feed 50 %", RtCommand::Kind::kOverride, 0.5},
    {"impeller.ngc", "feed 150 %", RtCommand::Kind::kOverride, 1.5},
    {"impeller.ngc", "rapid 25 %", RtCommand::Kind::kRapidOverride, 0.25},
    {"pocket.ngc", "none", RtCommand::Kind::kOverride, 1},
    {"pocket.ngc", "feed 50 %", RtCommand::Kind::kOverride, 0.5},
    {"pocket.ngc", "feed 150 %", RtCommand::Kind::kOverride, 1.5},
    {"pocket.ngc", "rapid 25 %", RtCommand::Kind::kRapidOverride, 0.25},
    {"engraving.ngc", "none", RtCommand::Kind::kOverride, 1},
    {"engraving.ngc", "feed 50 %", RtCommand::Kind::kOverride, 0.5},
    {"engraving.ngc", "feed 150 %", RtCommand::Kind::kOverride, 1.5},
    {"engraving.ngc", "rapid 25 %", RtCommand::Kind::kRapidOverride, 0.25},
};

// By hand: 6 s at G95, 4 s of a plain feed, 2 s of rapid moves.
TEST(PlanTime, FeedPerTurnGoesWithTheSpindlesOverride) {
  PlanTime time;
  time.add({.feed = true, .spindle = true}, 6);
  time.add({.feed = true}, 4);
  time.add({.rapid = true}, 2);
  EXPECT_DOUBLE_EQ(time.total_s(), 12);
  EXPECT_DOUBLE_EQ(time.real_s({.spindle = 1.5}), 4 + 4 + 2);
  EXPECT_DOUBLE_EQ(time.real_s({.feed = 0.5, .spindle = 1.5}), 8 + 8 + 2);
  EXPECT_TRUE(std::isinf(time.real_s({.spindle = 0})));
}

// Nobody knows what the machine will say: the tool is in, an input is 0, and a probe meets its work where the
// move was programmed to end.
TEST(ProgramTime, GuessesWhatTheMachineWillAnswer) {
  Assembly assembly = assemble(source_dir() + "/configs/mill.toml");
  Parameters parameters;
  ToolTable tools;
  Pipeline pipeline(assembly, parameters, tools,
                    {"t", "G21 G90\nG1 X10 Y-4 Z-5 F600\nM2\n", JointVec::Zero(3)}, {});
  MotionBlock last;
  for (MotionBlock block; pipeline.next(block);)
    if (block.segment_count > 0) last = block;
  ASSERT_GT(last.segment_count, 0);
  QueueEvent event;
  event.kind = QueueEvent::Kind::kToolChange;
  const ProgramAnswer tool = guessed_answer(event, *assembly.map, last);
  EXPECT_EQ(tool.value, 1);
  EXPECT_FALSE(tool.probe);
  event.kind = QueueEvent::Kind::kWaitInput;
  const ProgramAnswer input = guessed_answer(event, *assembly.map, last);
  EXPECT_EQ(input.value, 0);
  EXPECT_FALSE(input.probe);
  event.kind = QueueEvent::Kind::kProbeEnd;
  const ProgramAnswer probe = guessed_answer(event, *assembly.map, last);
  EXPECT_EQ(probe.value, 1);
  ASSERT_TRUE(probe.probe);
  EXPECT_LT((probe.q_contact - Vec3(10, 4, -5)).norm(), 1e-9) << "Y moves the table";
  EXPECT_LT((probe.y_stand.head<3>() - Vec3(10, -4, -5)).norm(), 1e-9);
  const ProgramAnswer nowhere = guessed_answer(event, *assembly.map, MotionBlock());
  EXPECT_EQ(nowhere.value, 0);
  EXPECT_FALSE(nowhere.probe) << "without a motion there is no place";
}

class TimeLeft : public testing::TestWithParam<Case> {};

TEST_P(TimeLeft, IsRightWithinTwoPercent) {
  const Case& c = GetParam();
  TimedRun run(c.program);
  TimedRun first(c.program);
  const double whole_s = first.time_s(first.run({}));
  EXPECT_NEAR(first.total_s(), whole_s, 0.005 * whole_s);
  // From the first second on, also behind the change.
  const double at_s = c.share == 1 ? 0 : whole_s / 2;
  const auto promises = run.run({{at_s, c.kind, c.share}});
  const double time_s = run.time_s(promises), from = (at_s + kSeen_s) / time_s;
  const double worst = worst_error(promises, from, 1);
  fmt::print("{:14} {:11} {:7.2f} s, error of the time left, % of the whole: worst {:5.2f}; at", c.program,
             c.name, time_s, 100 * worst);
  for (int part = 0; part < 5; ++part) {
    const double share = from + (1 - from) * part / 5;
    fmt::print(" {:.0f} %: {:.2f}", 100 * share, 100 * worst_error(promises, share, share + 1e-3));
  }
  fmt::print("\n");
  EXPECT_LT(worst, 0.02);
}

INSTANTIATE_TEST_SUITE_P(Programs, TimeLeft, testing::ValuesIn(kCases));

}  // namespace
}  // namespace trn
