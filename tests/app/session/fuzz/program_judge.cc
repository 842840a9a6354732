#include "tests/app/session/fuzz/program_judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "app/check/deviation_meter.h"
#include "app/check/limit_judge.h"
#include "app/session/assembly.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/motion.h"
#include "core/ports.h"
#include "core/units.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"
#include "kernel/rt_messages.h"
#include "sim/micromill/micro_mill_drives.h"
#include "tests/support/program_words.h"

namespace trn::fuzz {

namespace {

constexpr double kExactMm = 2e-6, kExactDeg = 2e-5;  // rounding of six-digit words through the kinematics
constexpr double kEndMm = 1e-6, kEndRad = 1e-8;
constexpr double kTimeShare =
    0.995;  // of a block's time: where two blocks meet is known to a share of the tolerance
constexpr double kSecondsOver = 20;  // looked at every so many seconds of motion
constexpr double kSecondsMax = 600;  // of a program whose moves are not counted; it is stopped then
constexpr double kStartMm = 0.02;
constexpr double kRoom = 1.03;  // of the time that a stop behind every move takes
// The same in G64: the share of a smooth curve that belongs to a block may be longer than the block. It was
// by 6 % where a block of 0.33 mm at F3.3 had a tolerance of 0.35 mm.
constexpr double kRoomOnCurve = 1.1;

/// Thrown to end a run that takes far too long.
struct TooLong {};

/// Time of a jerk-limited move of length 1 from rest to rest, limits per unit of it.
double rest_to_rest_s(double v, double a, double j) {
  const double to_a = a / j, accelerate = v * j >= a * a ? v / a + to_a : 2 * std::sqrt(v / j);
  if (v * accelerate <= 1) return accelerate + 1 / v;
  if (2 * a * to_a * to_a >= 1) return 4 * std::cbrt(1 / (2 * j));  // a is not reached
  return to_a + std::sqrt(to_a * to_a + 4 / a);                     // a is, v is not
}

/// How long the program takes at the most on a machine that stops after every move, from the words alone.
class TimeBound {
 public:
  TimeBound(const Assembly& assembly, const JointVec& q_start) : assembly_(assembly) {
    assembly.map->words_at(q_start, assembly.corrections.planned_off, at_);
    context_.corrections_off = assembly.corrections.planned_off;
    straight_ = ProgramGenerator::words_are_joints(assembly, at_);
  }

  void step(const Step& step) {
    if (step.rtcp_on) context_.rtcp = true;
    if (step.rtcp_off) context_.rtcp = false;
    if (step.text.rfind("G6", 0) == 0) room_ = step.text.rfind("G64", 0) == 0 ? kRoomOnCurve : kRoom;
    if (step.kind == Step::Kind::kDwell) total_s_ += step.time_s;
    if (!step.words) return add_least(step);
    if (!step.incremental)
      written_ |= step.words;  // where a distance leads to depends on where the drives stood
    Words to = at_;
    for (int k = 0; k < 6; ++k) {
      if (!(step.words >> k & 1)) continue;
      const double value = step.value[k] * (k >= kA ? kRadPerDeg : 1);
      to[k] = step.incremental ? at_[k] + value : value;
    }
    if (step.kind == Step::Kind::kArc || (to - at_).norm() > 0) add_least(step);  // no way takes no time
    const double periods_s = 4 * assembly_.machine.period_s;
    // A drive's homing may end a few counts beside its zero: the first move begins there, and so does the
    // first one that names a word.
    const bool first =
        !std::exchange(moved_, true) || (step.words & ~std::exchange(named_, named_ | step.words)) != 0;
    if (first) total_s_ += step.feed > 0 ? kStartMm / (step.feed / 60) : step.time_s;
    if (step.kind == Step::Kind::kArc)
      total_s_ += arc_s(step, std::abs(to[step.across] - at_[step.across])) + periods_s;
    else
      total_s_ += line_s(step, to) + periods_s;
    at_ = to;
  }
  double total_s() const { return total_s_ + 0.1; }
  /// What dwells and inverse time ask for.
  double least_s() const { return least_s_; }
  const Words& end() const { return at_; }
  unsigned written() const { return written_; }
  const MapContext& context() const { return context_; }
  /// Words as the joint map takes them: with RTCP on, the tip in the table frame.
  Words in_map(Words words) const {
    if (!context_.rtcp) return words;
    const Pose X_BM = assembly_.kinematics->home_X_BM();
    words.head<3>() = X_BM.R * words.head<3>() + X_BM.p;
    return words;
  }

 private:
  void add_least(const Step& step) {
    if (step.time_s > 0) least_s_ += std::max(0.0, kTimeShare * step.time_s - assembly_.machine.period_s);
  }
  double programmed_s(const Step& step, double way) const {
    if (step.kind == Step::Kind::kTraverse) return 0;
    return step.feed > 0 ? way / (step.feed / 60) : step.time_s;
  }

  // The joints' ways decide, straight where words are joints; elsewhere with room for their curvature.
  double line_s(const Step& step, const Words& to) const {
    const Words delta = to - at_;
    const double tip_way =
        delta.head<3>().norm();  // rounding, where distances have led back to the same words
    const double way = tip_way > 1e-9 ? tip_way : delta.tail<3>().norm() * kDegPerRad;
    const double asked_s = programmed_s(step, way);
    JointVec q0, q1;
    double v = asked_s > 0 ? 1 / asked_s : 1e9, a = 1e12, j = 1e15;
    if (!(delta.norm() > 0)) return 0;
    if (assembly_.map->map(in_map(at_), context_, q0) != KinStatus::kOk) return 1;
    if (assembly_.map->map(in_map(to), context_, q1) != KinStatus::kOk) return 1;
    for (Eigen::Index i = 0; i < q0.size(); ++i) {
      const JointLimit& limit = assembly_.plan_joints[static_cast<std::size_t>(i)].limit;
      const double d = std::max(1e-12, std::abs(q1[i] - q0[i]));
      v = std::min(v, limit.velocity / d);
      a = std::min(a, limit.acceleration / d);
      j = std::min(j, limit.jerk / d);
    }
    const bool direct = straight_ && !context_.rtcp && !assembly_.map->has_pose();
    return direct ? room_ * rest_to_rest_s(v, a, j) : 4 * rest_to_rest_s(v / 2, a / 4, j / 8) + asked_s;
  }

  double arc_s(const Step& step, double across) const {
    const double way = std::hypot(std::abs(step.sweep_rad) * step.radius_mm, across);
    double velocity = 1e9, acceleration = 1e12, jerk = 1e15;
    for (const Joint& joint : assembly_.plan_joints) {
      if (joint.kind != JointKind::kLinear) continue;
      velocity = std::min(velocity, joint.limit.velocity);
      acceleration = std::min(acceleration, joint.limit.acceleration);
      jerk = std::min(jerk, joint.limit.jerk);
    }
    const double r = step.radius_mm;
    const double v = std::min({velocity / 2, std::sqrt(acceleration * r) / 2, std::cbrt(jerk * r * r) / 2});
    const double slow = straight_ && !context_.rtcp ? 1 : 4;
    return slow * 1.5 * rest_to_rest_s(v / way, acceleration / 4 / way, jerk / 8 / way) +
           room_ * programmed_s(step, way);
  }

  const Assembly& assembly_;
  Words at_ = Words::Zero();
  MapContext context_;
  bool straight_ = false, moved_ = false;
  unsigned written_ = 0, named_ = 0;
  double total_s_ = 0, least_s_ = 0, room_ = kRoomOnCurve;
};

/// Keeps the last place of the plan.
struct LastPlace : ReportSink {
  void write(const CycleReport& report) override {
    q = report.q_plan;
    if (report.on_path) context = report.context;
  }
  JointVec q;
  MapContext context;
};

Finding limits(const SimulationResult& result, const Machine& machine) {
  for (std::size_t i = 0; i < result.joints.size(); ++i)
    for (std::size_t k = 0; k < kQuantityCount; ++k) {
      const Peak& peak = result.joints[i].peaks[k];
      if (peak.ratio <= LimitJudge::kRatioMax) continue;
      const char* quantity = to_string(static_cast<Quantity>(k));
      return {std::string("limit-") + quantity,
              fmt::format("{} {} {:.6f} of its limit at {:.3f} s, line {}", machine.joints[i].name, quantity,
                          peak.ratio, peak.t_s, peak.line),
              false};
    }
  return {};
}

Finding deviation(const SimulationResult& result) {
  const DeviationReport& d = result.deviation;
  double left_deg = 0, left_mm = 0;  // what a correction at work could not put right
  for (const CorrectionSummary& correction : result.corrections) {
    left_deg = std::max(left_deg, correction.left_axis_rad * kDegPerRad);
    left_mm = std::max(left_mm, correction.left_tip_mm);
  }
  const auto told = [](const char* kind, const char* what, const WorstDeviation& worst) {
    return Finding{kind, fmt::format("{}: {:.9g}, line {}", what, worst.value, worst.line), false};
  };
  if (d.tip_ratio.value > 1 + 1e-9 && left_mm == 0)
    return told("tolerance-tip", "tip deviation over the tolerance", d.tip_ratio);
  if (d.axis_ratio.value > 1 + 1e-9 && left_deg == 0)
    return told("tolerance-axis", "axis deviation over the tolerance", d.axis_ratio);
  if (d.tip_exact_mm.value > kExactMm + left_mm)
    return told("exact-tip", "tip deviation in an exact mode, mm", d.tip_exact_mm);
  if (d.axis_exact_deg.value > kExactDeg + left_deg)
    return told("exact-axis", "axis deviation in an exact mode, deg", d.axis_exact_deg);
  if (d.lost > 0) return {"lost", fmt::format("{} samples off the path", d.lost), false};
  return {};
}

// Words written as distances only lead from where the drives came up, which need not be zero to the digit.
Finding end_point(const Assembly& assembly, const TimeBound& bound, const LastPlace& last) {
  if (last.q.size() == 0) return {};
  const unsigned all = program_words(assembly);
  if (bound.context().rtcp && (bound.written() & all) != all) return {};
  Words words = bound.end(), standing;
  const auto off = bound.context().corrections_off;
  if (!bound.context().rtcp && assembly.map->words_at(last.q, off, standing) == KinStatus::kOk)
    for (int k = 0; k < 6; ++k)
      if (!(bound.written() >> k & 1)) words[k] = standing[k];
  JointVec q;
  if (assembly.map->map(bound.in_map(words), bound.context(), q) != KinStatus::kOk) return {};
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    const Joint& joint = assembly.machine.joints[static_cast<std::size_t>(i)];
    if (std::abs(q[i] - last.q[i]) <= (joint.kind == JointKind::kRotary ? kEndRad : kEndMm)) continue;
    return {"end", fmt::format("{} ends at {:.9g}, programmed {:.9g}", joint.name, last.q[i], q[i]), false};
  }
  return {};
}

// A stage that really cuts cannot follow any feed: 20 m/min through 5 mm of metal stalls it, and it says so.
// What it was told until then is judged all the same.
bool stalls(const Assembly& assembly, const SimulationResult& result) {
  return result.fault == Fault::kFollowingError &&
         dynamic_cast<const MicroMillDrives*>(assembly.drives.get()) != nullptr;
}

Finding judged(const Assembly& assembly, const SimulationResult& result, const Program& program,
               const Driving& driving, const TimeBound& bound, const LastPlace& last) {
  const bool stalled = stalls(assembly, result);
  if (result.fault != Fault::kOk && !stalled)
    return {"fault", std::string(fault_info(result.fault).name), false};
  Finding found = limits(result, assembly.machine);
  if (found.kind.empty()) found = deviation(result);
  if (!found.kind.empty()) return found;
  if (result.starvations) return {"starvation", fmt::format("{} times", result.starvations), false};
  if (result.speed.fallbacks) return {"plan-stop", fmt::format("{} times", result.speed.fallbacks), false};
  if (stalled) return {};
  if (program.plain) found = end_point(assembly, bound, last);
  if (found.kind.empty() && program.plain && driving.as_programmed() && result.cycle_time_s > bound.total_s())
    return {
        "slow",
        fmt::format("{:.3f} s, with a stop behind every move {:.3f} s", result.cycle_time_s, bound.total_s()),
        false};
  if (found.kind.empty() && program.plain && driving.as_programmed() && result.cycle_time_s < bound.least_s())
    return {"fast",
            fmt::format("{:.3f} s, dwells and inverse time ask for {:.3f} s", result.cycle_time_s,
                        bound.least_s()),
            false};
  return found;
}

}  // namespace

Finding judge(const std::string& config, const Program& program, const Driving& driving) {
  Assembly assembly = assemble(config);
  Parameters parameters;
  ToolTable tools = ToolTable::parse("T1 P1 Z+50 D6\nT2 P2 Z+80 D8\nT3 P3 Z+95 D5\n", "t.tbl");
  const JointVec q_start = standing_joints(assembly);
  TimeBound bound(assembly, q_start);
  for (const Step& step : program.steps) bound.step(step);
  LastPlace last;
  SimulationOptions options;
  options.program = "fuzz.ngc";
  options.program_text = program.text();
  options.script = driving.script;
  options.single_block = driving.single_block;
  options.trace = &last;
  // How long a program with tools and offsets takes is not counted beforehand.
  if (!program.plain) options.stop_after_s = kSecondsMax;
  options.progress = [&](std::uint32_t, double time_s) {
    const double wait_s = driving.as_programmed() ? 0 : 10 * bound.total_s() + 60;
    if (program.plain && time_s > bound.total_s() + kSecondsOver + wait_s) throw TooLong{};
  };
  try {
    check_program(assembly, parameters, tools, {options.program, options.program_text, q_start}, {});
    const SimulationResult result = simulate(assembly, parameters, tools, options);
    return judged(assembly, result, program, driving, bound, last);
  } catch (const ProgramError& error) {
    const std::string text = error.what();
    if (text.rfind("fuzz.ngc:", 0) == 0) return {"", text, true};
    return {"message", "an error without its place: " + text, false};
  } catch (const TooLong&) {
    return {"slow", fmt::format("far over {:.3f} s, which a stop behind every move takes", bound.total_s()),
            false};
  } catch (const std::exception& error) {
    return {"exception", error.what(), false};
  }
}

namespace {

/// Leaves out `chunk` lines at a time wherever the finding stays; true if some could go.
bool leave_out(std::size_t chunk, const std::string& config, const Driving& driving, const std::string& kind,
               Program& best, int& runs_left) {
  bool fewer = false;
  for (std::size_t at = 0; at < best.steps.size() && runs_left > 0; --runs_left) {
    Program trial = best;
    const auto first = trial.steps.begin() + static_cast<std::ptrdiff_t>(at);
    const std::size_t end = std::min(at + chunk, trial.steps.size());
    trial.steps.erase(first, trial.steps.begin() + static_cast<std::ptrdiff_t>(end));
    if (judge(config, trial, driving).kind == kind) {
      best = std::move(trial);
      fewer = true;
    } else {
      at += chunk;
    }
  }
  return fewer;
}

}  // namespace

Program shrink(const std::string& config, const Program& program, const Driving& driving,
               const Finding& finding, int runs_max) {
  Program best = program;
  for (std::size_t chunk = std::max<std::size_t>(1, best.steps.size() / 2); chunk > 0 && runs_max > 0;)
    if (!leave_out(chunk, config, driving, finding.kind, best, runs_max)) chunk /= 2;
  return best;
}

}  // namespace trn::fuzz
