#include "app/lab/run_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "app/check/deviation_meter.h"
#include "app/check/limit_judge.h"
#include "app/session/feature_report.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/units.h"
#include "sim/simulated_screws.h"

namespace trn {

namespace {

std::string duration(double s) {
  const int minutes = static_cast<int>(s) / 60;
  return minutes ? fmt::format("{} min {:.3f} s", minutes, s - 60 * minutes) : fmt::format("{:.3f} s", s);
}

double percent(double part, double whole) { return whole > 0 ? 100 * part / whole : 0; }

double speed_up(const SimulationResult& r) { return r.wall_s > 0 ? r.cycle_time_s / r.wall_s : 0; }

nlohmann::json place(const WorstDeviation& worst) { return {{"value", worst.value}, {"line", worst.line}}; }

}  // namespace

namespace {

std::string correction_line(const CorrectionSummary& c) {
  std::string out = fmt::format("  correction {:<12} up to {:.6f} mm, {:.6f} deg", c.name, c.peak_mm,
                                c.peak_rad * kDegPerRad);
  if (c.left_tip_mm > 0 || c.left_axis_rad > 0)
    out += fmt::format("; leaves {:.1e} mm, {:.1e} deg", c.left_tip_mm, c.left_axis_rad * kDegPerRad);
  if (!c.warning.empty()) out += "; " + c.warning;
  return out + "\n";
}

std::string screw_line(const SimulatedScrews::Report& s, const Machine& machine) {
  return fmt::format(
      "  screw {:<17} {:.1f} K warm: nut off by up to {:.2f} um without correction, {:.2f} um left\n",
      machine.joints[static_cast<std::size_t>(s.joint)].name, s.rise_K, 1000 * s.worst.without,
      1000 * s.worst.left);
}

nlohmann::json screws_json(const SimulationResult& r, const Machine& machine) {
  nlohmann::json out = nlohmann::json::array();
  for (const SimulatedScrews::Report& s : r.screws)
    out.push_back({{"joint", machine.joints[static_cast<std::size_t>(s.joint)].name},
                   {"rise_K", s.rise_K},
                   {"error_without_mm", s.worst.without},
                   {"error_left_mm", s.worst.left}});
  return out;
}

nlohmann::json corrections_json(const SimulationResult& r) {
  nlohmann::json out = nlohmann::json::array();
  for (const CorrectionSummary& c : r.corrections)
    out.push_back({{"name", c.name},
                   {"peak_mm", c.peak_mm},
                   {"peak_rad", c.peak_rad},
                   {"left_tip_mm", c.left_tip_mm},
                   {"left_axis_rad", c.left_axis_rad},
                   {"warning", c.warning}});
  return out;
}

}  // namespace

namespace {

std::string length(double mm) {
  return mm < 1000 ? fmt::format("{:.0f} mm", mm) : fmt::format("{:.2f} m", mm / 1000);
}

/// The limit that was used for longest.
struct Bound {
  std::size_t joint = 0;
  const char* what = "";
  double time_s = 0;
};

Bound longest_bound(const SimulationResult& r) {
  Bound worst;
  for (std::size_t i = 0; i < r.at_limit.size(); ++i) {
    const TimeAtLimit& at = r.at_limit[i];
    for (const Bound& bound : {Bound{i, "velocity", at.velocity}, Bound{i, "acceleration", at.acceleration},
                               Bound{i, "jerk", at.jerk}})
      if (bound.time_s > worst.time_s) worst = bound;
  }
  return worst;
}

/// "the jerk of joint C for 40 % of the time, the programmed feed for 12 %", the greater first.
std::string bounds_text(const SimulationResult& r, const Machine& machine, bool feed_first) {
  const Bound bound = longest_bound(r);
  if (bound.time_s == 0) return "the programmed feed and dwells; no joint comes to a limit";
  const std::string feed = fmt::format("the programmed feed or a dwell for {:.0f} % of the time",
                                       percent(r.free_s, r.cycle_time_s));
  const std::string joint =
      fmt::format("the {} of joint {} for {:.0f} %", bound.what, machine.joints[bound.joint].name,
                  percent(bound.time_s, r.cycle_time_s));
  return feed_first ? feed + ", " + joint : joint + ", " + feed;
}

}  // namespace

std::string run_sentence(const SimulationResult& r, const Machine& machine, const std::string& program) {
  const bool feed_first = r.free_s >= longest_bound(r).time_s;
  const std::string at =
      r.stopped_at.value_or(0) > 0 ? fmt::format("at line {}", *r.stopped_at) : "before its first motion";
  const std::string how = r.fault != Fault::kOk ? "was ended by a fault"
                          : r.stopped_at        ? "was stopped " + at
                                                : "ran through";
  const std::string what =
      fmt::format("\n{} {} on {} in {}: {} lines, {} of tool path.\n", program.substr(program.rfind('/') + 1),
                  how, machine.name, duration(r.cycle_time_s), r.lines, length(r.path_mm));
  if (r.stopped_at && r.path_mm == 0) return what;
  // Dwells and threads have no F: nothing moves, or the spindle gives the feed.
  const bool has_feed = r.path_mm > 0 && r.geared_s < r.free_s / 2;
  const std::string advice = !feed_first
                                 ? "A wider tolerance (G64 P) makes it faster; a higher F hardly does.\n"
                             : has_feed ? "A higher F makes it faster.\n"
                                        : "";
  return what + fmt::format("What limits it: {}.\n{}", bounds_text(r, machine, feed_first), advice);
}

std::string run_summary(const SimulationResult& r, const Machine& machine, const std::string& program) {
  // Where nothing deviates there is no line either.
  const auto at = [](const auto& worst) {
    return worst.line > 0 ? fmt::format(" at line {}", worst.line) : "";
  };
  std::string out = fmt::format("{} on {}\n", program, machine.name);
  out += fmt::format("  cycle time       {}  ({} periods of {:g} ms)\n", duration(r.cycle_time_s), r.periods,
                     1e3 * machine.period_s);
  out += fmt::format("  program          {} lines, {:.1f} mm of tip path\n", r.lines, r.path_mm);
  out +=
      fmt::format("  simulated        in {:.2f} s, {:.1f} times faster than real time (planning {:.2f} s)\n",
                  r.wall_s, speed_up(r), r.planning_s);
  out += fmt::format("  tip deviation    {:.6f} mm{} ({:.1f} % of the tolerance); exact modes {:.1e} mm\n",
                     r.deviation.tip_mm.value, at(r.deviation.tip_mm), 100 * r.deviation.tip_ratio.value,
                     r.deviation.tip_exact_mm.value);
  out +=
      fmt::format("  axis deviation   {:.6f} deg{} ({:.1f} % of the tolerance)\n", r.deviation.axis_deg.value,
                  at(r.deviation.axis_deg), 100 * r.deviation.axis_ratio.value);
  out += fmt::format("  starvations      {}; stops to wait for a better plan: {}\n", r.starvations,
                     r.speed.fallbacks);
  out += "  joint    worst ratio to the limit                        time at the limit, %\n";
  out += "           velocity  acceleration  jerk      position      velocity  acceleration  jerk\n";
  for (std::size_t i = 0; i < machine.joints.size(); ++i) {
    const JointVerdict& v = r.joints[i];
    const TimeAtLimit& t = r.at_limit[i];
    out += fmt::format("  {:<8} {:<9.6f} {:<13.6f} {:<9.6f} {:<13.6f} {:<9.1f} {:<13.1f} {:.1f}\n",
                       machine.joints[i].name, v.peak(Quantity::kVelocity).ratio,
                       v.peak(Quantity::kAcceleration).ratio, v.peak(Quantity::kJerk).ratio,
                       v.peak(Quantity::kPosition).ratio, percent(t.velocity, r.cycle_time_s),
                       percent(t.acceleration, r.cycle_time_s), percent(t.jerk, r.cycle_time_s));
  }
  out += fmt::format("  no joint at a limit {:.1f} % of the time\n", percent(r.free_s, r.cycle_time_s));
  for (const CorrectionSummary& c : r.corrections) out += correction_line(c);
  for (const SimulatedScrews::Report& s : r.screws) out += screw_line(s, machine);
  out += features_text(r.features);
  out += r.within_limits ? "  every joint within its limits\n" : "  A JOINT LEFT ITS LIMITS\n";
  if (r.deviation.broken()) out += "  THE TOOL LEFT ITS TOLERANCE\n";
  return out;
}

std::string broken_promises(const SimulationResult& r, const Machine& machine) {
  std::string out;
  for (std::size_t i = 0; i < machine.joints.size(); ++i)
    for (const Quantity quantity :
         {Quantity::kPosition, Quantity::kVelocity, Quantity::kAcceleration, Quantity::kJerk}) {
      const Peak& peak = r.joints[i].peak(quantity);
      if (peak.over == 0) continue;
      out += fmt::format("line {}: joint {} went to {:.6f} of its limit of {}, at {:.3f} s\n", peak.line,
                         machine.joints[i].name, peak.ratio, to_string(quantity), peak.t_s);
    }
  const DeviationReport& d = r.deviation;
  if (d.tip_over_mm.value > 0)
    out += fmt::format("line {}: the tool tip is {:.6f} mm farther off the programmed path than is allowed\n",
                       d.tip_over_mm.line, d.tip_over_mm.value);
  if (d.axis_over_deg.value > 0)
    out +=
        fmt::format("line {}: the tool axis is {:.6f} deg farther off the programmed one than is allowed\n",
                    d.axis_over_deg.line, d.axis_over_deg.value);
  if (!out.empty()) out += "this is a defect of the control: keep the program and report it\n";
  return out;
}

std::string run_json(const SimulationResult& r, const Machine& machine, const std::string& program) {
  nlohmann::json joints = nlohmann::json::array();
  for (std::size_t i = 0; i < machine.joints.size(); ++i) {
    const Joint& joint = machine.joints[i];
    const JointLimit& l = joint.limit;
    nlohmann::json ratios, at_limit;
    for (const Quantity q :
         {Quantity::kPosition, Quantity::kVelocity, Quantity::kAcceleration, Quantity::kJerk})
      ratios[to_string(q)] = r.joints[i].peak(q).ratio;
    at_limit = {{"velocity", r.at_limit[i].velocity},
                {"acceleration", r.at_limit[i].acceleration},
                {"jerk", r.at_limit[i].jerk}};
    joints.push_back({{"name", joint.name},
                      {"unit", joint.kind == JointKind::kRotary ? "rad" : "mm"},
                      {"limits",
                       {{"min", l.min},
                        {"max", l.max},
                        {"velocity", l.velocity},
                        {"acceleration", l.acceleration},
                        {"jerk", l.jerk}}},
                      {"ratios", ratios},
                      {"time_at_limit_s", at_limit}});
  }
  const DeviationReport& d = r.deviation;
  const nlohmann::json out = {
      {"program", program},
      {"machine", machine.name},
      {"cycle_time_s", r.cycle_time_s},
      {"period_s", machine.period_s},
      {"periods", r.periods},
      {"lines", r.lines},
      {"path_mm", r.path_mm},
      {"joints", joints},
      {"corrections", corrections_json(r)},
      {"screws", screws_json(r, machine)},
      {"features", features_json(r.features)},
      {"within_limits", r.within_limits},
      {"free_of_limits_s", r.free_s},
      {"tip_deviation_mm", d.tip_mm.value},
      {"axis_deviation_deg", d.axis_deg.value},
      {"deviation",
       {{"tip_mm", place(d.tip_mm)},
        {"axis_deg", place(d.axis_deg)},
        {"tip_share_of_tolerance", place(d.tip_ratio)},
        {"axis_share_of_tolerance", place(d.axis_ratio)},
        {"tip_exact_mm", place(d.tip_exact_mm)},
        {"axis_exact_deg", place(d.axis_exact_deg)},
        {"tip_over_mm", place(d.tip_over_mm)},
        {"axis_over_deg", place(d.axis_over_deg)},
        {"samples_lost", d.lost}}},
      {"starvations", r.starvations},
      {"plan_stops", r.speed.fallbacks},
      {"planned_pieces", r.speed.pieces},
      {"planning_s", r.planning_s},
      {"wall_s", r.wall_s},
      {"times_real_time", speed_up(r)},
      {"stopped_at_line", r.stopped_at ? nlohmann::json(*r.stopped_at) : nlohmann::json()},
      {"fault", fault_info(r.fault).name}};
  return out.dump(2) + "\n";
}

}  // namespace trn
