#include "compensation/joint_tables.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "core/units.h"

namespace trn {

namespace {

constexpr int kUndoSteps = 4;  // each shrinks the error by the table's slope, at most kSlopeMax
constexpr double kSlopeMax = 0.02;

Spline spline_at(const ConfigTable& table, const char* key, const std::vector<double>& places,
                 const std::vector<double>& values) {
  try {
    return {places, values};
  } catch (const std::invalid_argument& bad) {
    throw table.error(key, bad.what());
  }
}

std::vector<double> scaled(std::vector<double> values, double unit) {
  for (double& value : values) value *= unit;
  return values;
}

void read_curves(const ConfigTable& table, const std::string& unit_name, double unit, JointTable& out) {
  const std::string at = "at_" + unit_name, forward = "forward_" + unit_name,
                    backward = "backward_" + unit_name;
  const std::vector<double> places = scaled(table.numbers(at), unit);
  const std::vector<double> there = scaled(table.numbers(forward), unit);
  const std::vector<double> back = table.has(backward) ? scaled(table.numbers(backward), unit) : there;
  if (there.size() != places.size() || back.size() != places.size())
    throw table.error(at, fmt::format("{} places, but {} values forward and {} backward", places.size(),
                                      there.size(), back.size()));
  std::vector<double> mean, gap;
  for (std::size_t i = 0; i < there.size(); ++i) {
    // What both directions share is known beforehand and goes into the plan. Half of their difference, with
    // the sign of the direction, is added behind it on each reversal.
    mean.push_back((there[i] + back[i]) / 2);
    gap.push_back((back[i] - there[i]) / 2);
  }
  out.mean = spline_at(table, at.c_str(), places, mean);
  out.half_gap = spline_at(table, at.c_str(), places, gap);
}

}  // namespace

void JointTables::correct(JointVec& q) const TRN_RT {
  for (const JointTable& table : tables_) q[table.joint] += table.correction(q[table.joint]);
}

void JointTables::undo(JointVec& q) const TRN_RT {
  for (const JointTable& table : tables_) {
    const double corrected = q[table.joint];
    double& value = q[table.joint];
    // There is no closed form of the way back. The correction changes by at most 2 % of the way, so each turn
    // of the loop leaves at most 2 % of what was wrong.
    for (int i = 0; i < kUndoSteps; ++i) value = corrected - table.correction(value);
  }
}

BacklashCorrection::BacklashCorrection(std::vector<JointTable> tables) {
  for (JointTable& table : tables) plays_.push_back({std::move(table), 0, 0});
}

unsigned BacklashCorrection::joint_mask() const {
  unsigned mask = 0;
  for (const Play& play : plays_)
    if (play.table.backlash > 0 || play.table.half_gap.peak() > 0) mask |= 1u << play.table.joint;
  return mask;
}

void BacklashCorrection::wanted(const CorrectionInput& input, JointVec& offset) TRN_RT {
  for (Play& play : plays_) {
    const double q = input.q[play.table.joint];
    // Going on in the same direction: the edge goes with the axis.
    if (play.direction == 0 || (q - play.edge) * play.direction > 0) {
      if (play.direction == 0 && q != play.edge) play.direction = q > play.edge ? 1 : -1;
      play.edge = q;
      // A reversal counts only after the axis has gone back by the hysteresis. Otherwise a plan that stands
      // at a place but for its rounding would make the screw knock from flank to flank.
    } else if (std::abs(q - play.edge) > play.table.hysteresis) {
      play.direction = -play.direction;
      play.edge = q;
    }
    offset[play.table.joint] = play.direction * play.table.gap(q);
  }
}

std::vector<JointTable> read_joint_tables(const Machine& machine, const ConfigTable& section) {
  std::vector<std::string> names;
  for (const Joint& joint : machine.joints) names.push_back(joint.name);
  std::vector<JointTable> out;
  for (const ConfigTable& table : section.tables("joint")) {
    const std::string name = table.choice("joint", names);
    JointTable read;
    read.joint = static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
    if (std::any_of(out.begin(), out.end(), [&](const JointTable& t) { return t.joint == read.joint; }))
      throw table.error("joint", "this joint has its table already");
    const bool rotary = machine.joints[static_cast<std::size_t>(read.joint)].kind == JointKind::kRotary;
    const std::string unit_name = rotary ? "deg" : "mm";
    const double unit = rotary ? kRadPerDeg : 1;
    read.slope = table.number("slope", 0, Range{-kSlopeMax, kSlopeMax});
    read.backlash = unit * table.number("backlash_" + unit_name, 0, Range{0, 5});
    read.hysteresis = unit * table.number("hysteresis_" + unit_name, 1e-3, kPositive);
    if (table.has("at_" + unit_name)) read_curves(table, unit_name, unit, read);
    // The speed planner reserves nothing for the slope of a table but sees it in the joint map. 2 % is far
    // above any real screw; more is a mistake in the units or in the sign of `at`.
    if (std::abs(read.slope) + read.mean.slope_max() > kSlopeMax)
      throw table.error("at_" + unit_name, fmt::format("the table is steeper than {:g}", kSlopeMax));
    out.push_back(std::move(read));
  }
  return out;
}

}  // namespace trn
