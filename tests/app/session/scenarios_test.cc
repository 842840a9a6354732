#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <random>

#include "app/check/limit_judge.h"
#include "app/session/assembly.h"
#include "app/session/corrections.h"
#include "app/session/inline_rate_plans.h"
#include "app/session/make_cycle.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/motion.h"
#include "hal/loopback.h"
#include "kernel/cycle.h"
#include "kernel/motion_queue.h"
#include "kernel/rate_plan.h"
#include "kernel/rt_messages.h"
#include "tests/kernel/planned_motion.h"
#include "tests/support/paths.h"
#include "tests/support/program_words.h"
#include "tests/support/rounds.h"

// The operator at any tick: overrides of feed and rapid, adaptive feed, hold, resume, single block, stop, and
// a planner that is late, or a rate planner. The joints are judged twice by a judge that shares no code with
// the law: the setpoints with all corrections by the period's differences, and the plan's joints on samples
// ten times denser. What a session's log would hold of each is driven again, to the same bits.
// TRN_LONG=10000: so many scenarios over all configs.
namespace trn {
namespace {

constexpr int kDensity = 10;
constexpr int kScenariosPerProgram = 20;
constexpr int kPeriodsMax = 1500;
constexpr int kRowsOfJudge = 4;  // that a difference takes

/// Blended strokes of every word, dwells, exact stops, words for the operator's rights, around the middle.
std::string seeded_program(const Assembly& assembly, std::uint64_t seed) {
  std::mt19937_64 rng(seed);
  std::uniform_real_distribution<double> u(-1, 1);
  std::string program = "G21 G94 G64 P0.02\n";
  const bool tilts = assembly.kinematics->joint_count() == 5 && assembly.machine.name.rfind("cradle", 0) == 0;
  if (tilts && u(rng) < 0.2) program += "M428\n";
  program += "G91\n";
  const unsigned mask = program_words(assembly);
  const char* kWords[] = {"M49\n",    "M48\n",    "M50 P0\n",   "M50 P1\n", "M53 P0\n",    "M53 P1\n",
                          "M52 P1\n", "M52 P0\n", "G4 P0.03\n", "G61.1\n",  "G64 P0.02\n", "M3 S900\n"};
  std::uniform_int_distribution<std::size_t> word(0, std::size(kWords) - 1);
  Words at = Words::Zero();
  for (int i = 0; i < 14; ++i) {
    if (u(rng) > 0.3) program += kWords[word(rng)];
    const int feed = u(rng) < 0 ? 1500 : u(rng) < 0 ? 6000 : 30000;
    program += u(rng) > 0.7 ? "G0" : "G1 F" + std::to_string(feed);
    for (int k = 0; k < 6; ++k) {
      if (!(mask >> k & 1) || u(rng) < -0.4) continue;
      const double range = k < 3 ? 12 : 2.5, to = range * u(rng);
      program += std::string(" ") + kWordLetters[k] + std::to_string(to - at[k]);
      at[k] = to;
    }
    program += "\n";
  }
  return program + "M2\n";
}

struct Tally {
  long scenarios = 0, periods = 0, steps = 0, holds = 0, stops = 0, starvations = 0;
  long late_rate_plans = 0, died_young = 0;
  std::vector<double> worst;  ///< of each scenario
};

/// What a session's log would hold of a scenario, and what it must lead to again.
struct Recording {
  struct Command {
    std::size_t period;
    RtCommand command;
  };
  struct Period {
    bool late = false;                  ///< an answer of the rate planner was
    std::uint32_t blocks_when_low = 0;  ///< seen by a tick with little ahead; else 0
    JointVec q_setpoint;
  };
  std::vector<Command> commands;
  std::vector<Period> periods;
};

/// Drives the motion again from a recording, as `replay` does from a log.
class Replayed {
 public:
  Replayed(const PlannedMotion& motion, const Recording& recording)
      : motion_(motion),
        recording_(recording),
        corrections_(read_corrections(motion.assembly().machine)),
        plans_(motion.assembly().plan_joints, motion.assembly().machine.period_s),
        queue_(motion.blocks().size() + 1),
        drives_(motion.q(0)),
        cycle_(cycle_config(motion.assembly(), ProgramStops::kPass),
               {*motion.assembly().map, queue_, drives_, plans_, corrections_.setpoint.get()}) {}

  /// Number of the first period with other setpoints, or how many there are.
  std::size_t first_difference() {
    cycle_.tick();
    drives_.bring_up();
    for (int i = 0; i < 3; ++i) cycle_.tick();
    for (std::size_t i = 0; i < recording_.periods.size(); ++i) {
      for (; next_ < recording_.commands.size() && recording_.commands[next_].period == i; ++next_)
        cycle_.post(recording_.commands[next_].command);
      fill(i);
      plans_.set_late(recording_.periods[i].late);
      cycle_.tick();
      if (!(cycle_.last_report().q_setpoint.array() == recording_.periods[i].q_setpoint.array()).all())
        return i;
    }
    return recording_.periods.size();
  }

 private:
  // As many blocks as are due, but never more than a later period with little ahead has seen.
  void fill(std::size_t period) {
    low_ = std::max(low_, period);
    while (low_ < recording_.periods.size() && recording_.periods[low_].blocks_when_low == 0) ++low_;
    const bool known = low_ < recording_.periods.size(), exact = known && low_ == period;
    const std::size_t most = known ? recording_.periods[low_].blocks_when_low : motion_.blocks().size();
    while (pushed_ < most && (exact || queue_.buffered_s() < motion_.assembly().planner.buffer_s) &&
           queue_.push(motion_.blocks()[pushed_]))
      ++pushed_;
  }

  const PlannedMotion& motion_;
  const Recording& recording_;
  Corrections corrections_;
  InlineRatePlans plans_;
  MotionQueue queue_;
  LoopbackDrives drives_;
  Cycle cycle_;
  std::size_t next_ = 0, pushed_ = 0, low_ = 0;
};

/// Who makes the rate plans beside the tick.
enum class RatePlannerHealth { kSound, kStarved, kDies };

/// One program under one operator.
class Scenario {
 public:
  Scenario(const PlannedMotion& motion, std::uint64_t seed,
           RatePlannerHealth health = RatePlannerHealth::kSound)
      : motion_(motion),
        rng_(seed),
        health_(health),
        period_s_(motion.assembly().machine.period_s),
        corrections_(read_corrections(motion.assembly().machine)),
        rate_plans_(motion.assembly().plan_joints, period_s_),
        queue_(motion.blocks().size() + 1),
        drives_(motion.q(0)),
        cycle_(cycle_config(motion.assembly(), ProgramStops::kPass),
               {*motion.assembly().map, queue_, drives_, rate_plans_, corrections_.setpoint.get()}),
        coarse_(motion.assembly().machine.joints, period_s_),
        dense_(motion.joints(), period_s_ / kDensity) {}

  const Recording& recording() const { return recording_; }
  /// False, with the reason in `why`, if something is not as promised.
  bool run(Tally& tally, std::string& why) {
    cycle_.tick();  // the drives are off: it learns where they stand
    drives_.bring_up();
    for (int i = 0; i < 3; ++i) cycle_.tick();
    coarse_(cycle_.last_report().q_setpoint);
    q_between_ = motion_.q(0);
    dense_(q_between_);
    fill();
    post(Kind::kStart, 0);
    if (chance(0.3)) post(Kind::kSingleBlock, 1);
    if (health_ == RatePlannerHealth::kDies) dies_in_ = static_cast<int>(between(3, 400));
    for (int i = 0; i < kPeriodsMax && (i < 3 || cycle_.last_report().motion != MotionState::kRest); ++i)
      if (!one_period(tally, why)) return false;
    if (dies_in_ < 0 && cycle_.last_report().motion == MotionState::kMoving && !cycle_.rate().standing()) {
      why = "moves on without a rate planner";
      if (!died_young_) return false;
      ++tally.died_young;
    }
    ++tally.scenarios;
    tally.late_rate_plans += cycle_.last_report().late_rate_plans;
    tally.starvations += cycle_.last_report().starvations;
    std::string at_setpoint, at_plan;
    const double setpoints = coarse_.worst(&at_setpoint), plan = dense_.worst(&at_plan);
    tally.worst.push_back(std::max(setpoints, plan));
    why = plan > setpoints ? "of the plan's samples: " + at_plan : "of the setpoints: " + at_setpoint;
    return tally.worst.back() <= LimitJudge::kRatioMax;
  }

 private:
  using Kind = RtCommand::Kind;

  bool chance(double p) { return std::uniform_real_distribution<double>(0, 1)(rng_) < p; }
  double between(double low, double high) { return std::uniform_real_distribution<double>(low, high)(rng_); }
  void post(Kind kind, double value) {
    recording_.commands.push_back({recording_.periods.size(), {kind, value}});
    cycle_.post({kind, value});
  }
  void fill() {
    const auto& blocks = motion_.blocks();
    while (pushed_ < blocks.size() && queue_.buffered_s() < motion_.assembly().planner.buffer_s &&
           queue_.push(blocks[pushed_]))
      ++pushed_;
    queue_.look();
  }
  /// Plan time of the place where the tick is.
  double plan_time() const {
    const std::uint32_t number = queue_.number_ahead(0);
    if (number == 0) return motion_.begin_s(static_cast<std::uint32_t>(pushed_ + 1));
    const PlanPlace place = cycle_.interpolator().place();
    const MotionBlock& block = motion_.blocks()[number - 1];
    double t = motion_.begin_s(number) + place.time_s;
    for (int k = 0; k < place.segment; ++k) t += block.segments[static_cast<std::size_t>(k)].duration_s;
    return t;
  }

  void operate(Tally& tally) {
    if (--next_ > 0) return;
    next_ = 1 + static_cast<int>(chance(0.3) ? between(0, 20) : between(0, 300));
    const double kind = between(0, 1);
    if (kind < 0.2)
      post(Kind::kHold, 0), ++tally.holds, held_ = true;
    else if (kind < 0.5)
      post(Kind::kOverride, chance(0.3) ? 2 : chance(0.2) ? 0 : between(0, 2)), sweep_ = 0;
    else if (kind < 0.6)
      sweep_ = between(-0.02, 0.02), swept_ = between(0, 2);
    else if (kind < 0.7)
      post(Kind::kRapidOverride, between(0.05, 1));
    else if (kind < 0.75)
      post(Kind::kAdaptiveFeed, between(0, 1));
    else if (kind < 0.9)
      post(Kind::kSingleBlock, chance(0.6) ? 1 : 0);
    else if (kind < 0.93)
      post(Kind::kStop, 0), ++tally.stops;
    else
      planner_sleeps_ = static_cast<int>(between(0, 600));
    if (held_ && chance(0.7)) post(Kind::kResume, 0), held_ = false;
  }

  void disturb_rate_planner() {
    moved_ = cycle_.interpolator().at_rest() || cycle_.rate().standing() ? 0 : moved_ + 1;
    if (health_ == RatePlannerHealth::kDies && --dies_in_ == -1) {
      rate_plans_.set_late(true);
      died_young_ = moved_ <= 2 * rate_lead_periods(period_s_);  // before the first answer had brought a stop
    }
    // A motion from rest still begins while answers are late by less than the tick's patience, 10 leads.
    const bool just_died = dies_in_ < 0 && -dies_in_ <= 11 * rate_lead_periods(period_s_);
    if (health_ == RatePlannerHealth::kDies && just_died && moved_ == 0) died_young_ = true;
    if (health_ != RatePlannerHealth::kStarved) return;
    if (starves_ == 0 && chance(0.02)) starves_ = static_cast<int>(between(1, chance(0.5) ? 8 : 200));
    rate_plans_.set_late(starves_ > 0);
    starves_ = std::max(0, starves_ - 1);
  }

  bool one_period(Tally& tally, std::string& why) {
    disturb_rate_planner();
    operate(tally);
    if (sweep_ != 0) post(Kind::kOverride, swept_ = std::clamp(swept_ + sweep_, 0.0, 2.0));
    if (--planner_sleeps_ < 0) fill();
    const bool was_paused = cycle_.last_report().motion == MotionState::kPaused;
    if (was_paused && chance(0.05)) post(Kind::kResume, 0);
    queue_.look();
    const double t0 = plan_time();
    cycle_.tick();
    ++tally.periods;
    const CycleReport& report = cycle_.last_report();
    recording_.periods.push_back({report.rate_plan_late, report.blocks_when_low, report.q_setpoint});
    if (report.fault != Fault::kOk) {
      why = "fault " + std::string(fault_info(report.fault).name);
      return false;
    }
    coarse_(report.q_setpoint);
    see_between(t0, report);
    if (report.motion == MotionState::kPaused && !was_paused) {
      ++tally.steps;
      return stands_at_line_end(why);
    }
    return true;
  }

  // After a stop the queue is forgotten: the tick stands at the end of its last step, or where it was.
  double plan_time_after_stop(double t0, const JointVec& q) const {
    const double t1 = std::min(t0 + cycle_.rate().plan_time_at(1), motion_.rest_after(t0));
    return (motion_.q(t1) - q).norm() < (motion_.q(t0) - q).norm() ? t1 : t0;
  }

  void see_between(double t0, const CycleReport& report) {
    const bool ended = report.motion == MotionState::kRest;
    const double t1 = ended ? plan_time_after_stop(t0, report.q_plan) : plan_time();
    still_ = t1 > t0 ? 0 : still_ + 1;
    if (still_ > kRowsOfJudge) return;  // it stands: nothing new to see
    for (int i = 1; i <= kDensity; ++i) {
      const double part = cycle_.rate().plan_time_at(static_cast<double>(i) / kDensity);
      if (t1 > t0) q_between_ = motion_.q(std::min(t0 + part, t1));
      dense_(q_between_);
    }
  }

  // A single block ends between two lines, to a thousandth of a period.
  bool stands_at_line_end(std::string& why) const {
    const double t = plan_time();
    for (std::size_t i = 1; i < motion_.blocks().size(); ++i) {
      const auto number = static_cast<std::uint32_t>(i + 1);
      if (motion_.blocks()[i].source.line == motion_.blocks()[i - 1].source.line) continue;
      if (std::abs(motion_.begin_s(number) - t) <= 1.01e-6) return true;
    }
    why = "a single block ends within a line, at " + std::to_string(t) + " of the plan";
    return false;
  }

  const PlannedMotion& motion_;
  std::mt19937_64 rng_;
  RatePlannerHealth health_;
  double period_s_;
  Corrections corrections_;
  InlineRatePlans rate_plans_;
  MotionQueue queue_;
  LoopbackDrives drives_;
  Cycle cycle_;
  JointJudge coarse_, dense_;
  std::size_t pushed_ = 0;
  int next_ = 5, planner_sleeps_ = 0, still_ = 0, starves_ = 0, dies_in_ = 0, moved_ = 0;
  bool died_young_ = false;
  JointVec q_between_;
  Recording recording_;
  bool held_ = false;
  double sweep_ = 0, swept_ = 1;
};

class Operator : public testing::TestWithParam<std::string> {};

void run_scenarios(const std::string& config, RatePlannerHealth health, int in_short) {
  const auto configs = static_cast<int>(shipped_configs().size());
  const int scenarios = test::rounds(in_short, configs);
  std::optional<PlannedMotion> motion;
  Tally tally;
  int failures = 0;
  for (int i = 0; i < scenarios; ++i) {
    if (i % kScenariosPerProgram == 0) {
      const auto seed = static_cast<std::uint64_t>(i / kScenariosPerProgram) + 1;
      motion.emplace(config, seeded_program(assemble(config), seed));
    }
    std::string why;
    Scenario scenario(*motion, static_cast<std::uint64_t>(i) + 1, health);
    if (!scenario.run(tally, why) && ++failures <= 5)
      ADD_FAILURE() << "scenario " << i << ": " << (tally.worst.empty() ? 0 : tally.worst.back()) << " "
                    << why;
    const std::size_t differs = Replayed(*motion, scenario.recording()).first_difference();
    EXPECT_EQ(differs, scenario.recording().periods.size())
        << "scenario " << i << ": replayed, its setpoints differ";
  }
  std::sort(tally.worst.begin(), tally.worst.end());
  const auto at = [&](double part) {
    return tally.worst[static_cast<std::size_t>(part * static_cast<double>(tally.worst.size() - 1))];
  };
  std::printf(
      "%d scenarios, %ld periods, %ld holds, %ld stops, %ld single blocks, %ld starvations, %ld late rate "
      "plans, %ld died at a motion's begin; "
      "worst ratio: median "
      "%.6f, 90 %% %.6f, 99 %% %.6f, worst %.7f; failures %d\n",
      scenarios, tally.periods, tally.holds, tally.stops, tally.steps, tally.starvations,
      tally.late_rate_plans, tally.died_young, at(0.5), at(0.9), at(0.99), at(1), failures);
  if (health == RatePlannerHealth::kStarved) {
    EXPECT_GT(tally.late_rate_plans, 0);
  }
}

TEST_P(Operator, MayDoAnythingAtAnyTick) { run_scenarios(GetParam(), RatePlannerHealth::kSound, 12); }

// The stop in store begins where an answer is late.
TEST_P(Operator, MayDoAnythingWhileTheRatePlannerStarves) {
  run_scenarios(GetParam(), RatePlannerHealth::kStarved, 12);
}

// And the machine stands, on its path: by a stop in store, or, where no answer had come since the motion's
// begin, so that none was there yet, where the path itself next comes to rest.
TEST_P(Operator, MayDoAnythingWhenTheRatePlannerDies) {
  run_scenarios(GetParam(), RatePlannerHealth::kDies, 12);
}

// What the operator changes rests on: the plan of each program alone, as it is driven at 100 %.
TEST_P(Operator, FindsAPlanWithinTheLimits) {
  const int programs = test::rounds(6, kScenariosPerProgram);
  double worst = 0;
  for (int seed = 1; seed <= programs; ++seed) {
    const PlannedMotion motion(GetParam(),
                               seeded_program(assemble(GetParam()), static_cast<std::uint64_t>(seed)));
    const double step_s = motion.assembly().machine.period_s / kDensity;
    JointJudge judge(motion.joints(), step_s);
    const auto rows = static_cast<long>(motion.length_s() / step_s);
    for (long i = 0; i <= rows; ++i) judge(motion.q(static_cast<double>(i) * step_s));
    std::string where;
    const double ratio = judge.worst(&where);
    worst = std::max(worst, ratio);
    EXPECT_LE(ratio, LimitJudge::kRatioMax) << "program " << seed << ": " << where;
  }
  std::printf("%d plans; worst ratio %.7f\n", programs, worst);
}

INSTANTIATE_TEST_SUITE_P(Configs, Operator, testing::ValuesIn(shipped_configs()), [](const auto& config) {
  return std::filesystem::path(config.param).stem().string();
});

}  // namespace
}  // namespace trn
