#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "app/check/limit_judge.h"
#include "app/check/trace_check.h"
#include "core/axes.h"
#include "core/machine.h"
#include "core/units.h"

namespace trn {

namespace {

constexpr std::array<Quantity, kQuantityCount> kQuantities = {Quantity::kPosition, Quantity::kVelocity,
                                                              Quantity::kAcceleration, Quantity::kJerk};
constexpr double kMargin = LimitJudge::kRatioMax - 1;  // what the verdict turns on

std::string unit_of(const Joint& joint, Quantity quantity) {
  static constexpr std::array<const char*, kQuantityCount> kPer = {"", "/s", "/s2", "/s3"};
  return (joint.kind == JointKind::kRotary ? "deg" : "mm") +
         std::string(kPer[static_cast<std::size_t>(quantity)]);
}

// People read degrees.
double shown(const Joint& joint, double value) {
  return joint.kind == JointKind::kRotary ? deg_from_rad(value) : value;
}

double limit_of(const JointLimit& limit, Quantity quantity, double value) {
  switch (quantity) {
    case Quantity::kPosition:
      // The end that the place is nearer to.
      return value < (limit.min + limit.max) / 2 ? limit.min : limit.max;
    case Quantity::kVelocity:
      return limit.velocity;
    case Quantity::kAcceleration:
      return limit.acceleration;
    case Quantity::kJerk:
      return limit.jerk;
  }
  return 0;
}

std::string table_row(const Joint& joint, Quantity quantity, const Peak& peak) {
  const char* mark = peak.ratio > LimitJudge::kRatioMax ? "  OVER" : "";
  const std::string over = peak.over ? fmt::format(" in {} rows", peak.over) : "";
  return fmt::format("{:<6} {:<12} {:>14.6g} {:>14.6g} {:<7} {:>11.8f} {:>12.6f} {:>8} {:>9.1e}{}{}\n",
                     joint.name, to_string(quantity), shown(joint, peak.value),
                     shown(joint, limit_of(joint.limit, quantity, peak.value)), unit_of(joint, quantity),
                     peak.ratio, peak.t_s, peak.line, peak.resolution_ratio, mark, over);
}

nlohmann::json peak_json(const Peak& peak) {
  return {{"value", peak.value}, {"ratio", peak.ratio}, {"t_s", peak.t_s},
          {"line", peak.line},   {"over", peak.over},   {"resolution_ratio", peak.resolution_ratio}};
}

nlohmann::json joint_json(const Joint& joint, const JointVerdict& verdict) {
  const JointLimit& limit = joint.limit;
  nlohmann::json ratios, peaks;
  for (const Quantity quantity : kQuantities) {
    ratios[to_string(quantity)] = verdict.peak(quantity).ratio;
    peaks[to_string(quantity)] = peak_json(verdict.peak(quantity));
  }
  return {{"name", joint.name},
          {"unit", joint.kind == JointKind::kRotary ? "rad" : "mm"},
          {"limits",
           {{"min", limit.min},
            {"max", limit.max},
            {"velocity", limit.velocity},
            {"acceleration", limit.acceleration},
            {"jerk", limit.jerk}}},
          {"ratios", ratios},
          {"peaks", peaks}};
}

}  // namespace

std::vector<std::string> resolution_notes(const TraceVerdict& verdict, const Joints& joints) {
  std::vector<std::string> notes;
  for (std::size_t i = 0; i < joints.size(); ++i) {
    if (verdict.joints[i].peak(Quantity::kVelocity).ratio == 0) continue;  // never moved
    for (const Quantity quantity : kQuantities) {
      const Peak& peak = verdict.joints[i].peak(quantity);
      // Rounding that cannot bring a ratio across the margin of the verdict need not be told.
      if (peak.resolution_ratio <= kMargin) continue;
      const bool noise = peak.resolution_ratio >= peak.ratio || peak.resolution_ratio >= 1;
      notes.push_back(
          fmt::format("{} {}: the recorded digits resolve this ratio only to {:.1e}; {}", joints[i].name,
                      to_string(quantity), peak.resolution_ratio,
                      noise ? "the figure is meaningless, write the trace with more digits or a longer step"
                            : "a ratio that near to 1 is not decided by this trace"));
    }
  }
  return notes;
}

std::string verdict_table(const TraceVerdict& verdict, const Machine& machine, const std::string& trace) {
  std::string out =
      fmt::format("{}: {} rows, {:.6f} s, step {:g} s, machine '{}' (period {:g} s)\n\n", trace, verdict.rows,
                  verdict.duration_s, verdict.step_s, machine.name, machine.period_s);
  if (verdict.pieces > 1)
    out += fmt::format("{} pieces, each judged by itself: between them the drives had no power\n\n",
                       verdict.pieces);
  out += fmt::format("{:<6} {:<12} {:>14} {:>14} {:<7} {:>11} {:>12} {:>8} {:>9}\n", "joint", "quantity",
                     "worst", "limit", "unit", "ratio", "at t_s", "line", "digits +-");
  for (std::size_t i = 0; i < machine.joints.size(); ++i)
    for (const Quantity quantity : kQuantities)
      out += table_row(machine.joints[i], quantity, verdict.joints[i].peak(quantity));
  for (const std::string& note : resolution_notes(verdict, machine.joints)) out += "note: " + note + "\n";
  out += verdict.within_limits ? fmt::format("\nwithin limits: every ratio <= {}\n", LimitJudge::kRatioMax)
                               : fmt::format("\nLIMITS BROKEN: a ratio is over {}\n", LimitJudge::kRatioMax);
  return out;
}

std::string verdict_json(const TraceVerdict& verdict, const Machine& machine, const std::string& trace) {
  nlohmann::json joints = nlohmann::json::array();
  for (std::size_t i = 0; i < machine.joints.size(); ++i)
    joints.push_back(joint_json(machine.joints[i], verdict.joints[i]));
  const nlohmann::json out = {{"trace", trace},
                              {"machine", machine.name},
                              {"period_s", machine.period_s},
                              {"step_s", verdict.step_s},
                              {"rows", verdict.rows},
                              {"pieces", verdict.pieces},
                              {"duration_s", verdict.duration_s},
                              {"ratio_max", LimitJudge::kRatioMax},
                              {"within_limits", verdict.within_limits},
                              {"joints", joints},
                              {"notes", resolution_notes(verdict, machine.joints)}};
  return out.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

}  // namespace trn
