#include "app/lab/following.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <stdexcept>

#include "app/session/simulation.h"
#include "core/fault.h"
#include "core/units.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"

namespace trn {

namespace {

double shown_unit(const Joint& joint) { return joint.kind == JointKind::kRotary ? kDegPerRad : 1; }
std::string_view unit_name(const Joint& joint) { return joint.kind == JointKind::kRotary ? "deg" : "mm"; }

std::vector<FollowingError> run_once(Assembly& assembly, const std::string& program,
                                     const std::string& tools) {
  Parameters parameters;
  ToolTable table;
  if (!tools.empty()) table = ToolTable::load(tools);
  FollowingMeter meter(assembly.machine.joints.size(), assembly.drives->feedback_periods());
  SimulationOptions options;
  options.program = program;
  options.trace = &meter;
  const SimulationResult result = simulate(assembly, parameters, table, options);
  if (result.fault != Fault::kOk)
    throw std::runtime_error(fmt::format("the run ended with the fault {}: {}; {}",
                                         fault_info(result.fault).name, fault_info(result.fault).meaning,
                                         assembly.drives->explain_fault(result.fault_joint)));
  return meter.errors();
}

// "12.3 times"; a joint that stands has no ratio.
std::string ratio(double without, double with) {
  return with > 0 && without > 1e-9 ? fmt::format("{:.1f}", without / with) : "-";
}

}  // namespace

void FollowingMeter::write(const CycleReport& report) {
  setpoints_.push_back(report.q_setpoint);
  if (setpoints_.size() <= lag_) return;
  const JointVec error = setpoints_.front() - report.q_measured;
  setpoints_.pop_front();
  for (std::size_t i = 0; i < sum_.size(); ++i) {
    const double e = std::abs(error[static_cast<Eigen::Index>(i)]);
    worst_[i] = std::max(worst_[i], e);
    sum_[i] += e * e;
  }
  ++periods_;
}

std::vector<FollowingError> FollowingMeter::errors() const {
  std::vector<FollowingError> out;
  for (std::size_t i = 0; i < sum_.size(); ++i)
    out.push_back({worst_[i], periods_ > 0 ? std::sqrt(sum_[i] / static_cast<double>(periods_)) : 0});
  return out;
}

std::vector<FollowingRun> run_following(const std::function<Assembly()>& make, const std::string& program,
                                        const std::string& tools) {
  std::vector<FollowingRun> runs = {
      {"without", false, false, {}}, {"velocity", true, false, {}}, {"velocity and torque", true, true, {}}};
  for (FollowingRun& run : runs) {
    Assembly assembly = make();
    if (!assembly.feed_forward)
      throw std::runtime_error("the config has no section [feed_forward]: there is nothing to compare");
    assembly.feed_forward->velocity = run.velocity;
    assembly.feed_forward->torque = run.torque;
    run.errors = run_once(assembly, program, tools);
  }
  return runs;
}

std::string following_table(const std::vector<FollowingRun>& runs, const Machine& machine) {
  std::string out = fmt::format("{:<8}", "");
  for (const FollowingRun& run : runs) out += fmt::format("  {:<21}", run.name);
  out += fmt::format("  {}\n{:<8}", "better by", "joint");
  for (std::size_t i = 0; i < runs.size(); ++i) out += fmt::format("  {:>10} {:>10}", "worst", "rms");
  out += fmt::format("  {:>7} {:>7}\n", "worst", "rms");
  for (std::size_t i = 0; i < machine.joints.size(); ++i) {
    const Joint& joint = machine.joints[i];
    out += fmt::format("{:<4} {:<3}", joint.name, unit_name(joint));
    for (const FollowingRun& run : runs)
      out += fmt::format("  {:>10.5f} {:>10.5f}", shown_unit(joint) * run.errors[i].worst,
                         shown_unit(joint) * run.errors[i].rms);
    const FollowingError &first = runs.front().errors[i], &last = runs.back().errors[i];
    out += fmt::format("  {:>7} {:>7}\n", ratio(first.worst, last.worst), ratio(first.rms, last.rms));
  }
  return out;
}

std::string following_json(const std::vector<FollowingRun>& runs, const Machine& machine) {
  nlohmann::ordered_json out = nlohmann::ordered_json::array();
  for (const FollowingRun& run : runs) {
    nlohmann::ordered_json joints = nlohmann::ordered_json::array();
    for (std::size_t i = 0; i < machine.joints.size(); ++i) {
      const Joint& joint = machine.joints[i];
      joints.push_back({{"joint", joint.name},
                        {"unit", unit_name(joint)},
                        {"worst", shown_unit(joint) * run.errors[i].worst},
                        {"rms", shown_unit(joint) * run.errors[i].rms}});
    }
    out.push_back({{"feed_forward", run.name}, {"joints", joints}});
  }
  return out.dump(2) + "\n";
}

}  // namespace trn
