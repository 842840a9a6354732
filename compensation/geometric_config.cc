#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "compensation/actual_chain.h"
#include "compensation/geometric.h"
#include "compensation/spline.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/machine.h"
#include "core/units.h"

namespace trn {

namespace {

constexpr double kRadPerArcsec = kRadPerDeg / 3600;
// 10 mm and 2 degrees are no errors any more but another machine; most likely the unit is wrong.
constexpr double kOffsetMax = 10, kTiltMaxArcsec = 7200;

/// Greatest slope of a column, by place: steeper than any way or turntable. Mostly the unit is wrong, or two
/// places lie too close together, and the curve swings between the others.
struct Steepest {
  double offset, tilt;
};
constexpr Steepest kLinearSteepest{0.02, 0.001}, kRotarySteepest{5, 0.02};

constexpr char kOffsets[] = "xyz", kTurns[] = "abc";

int joint_of(const Machine& machine, const ConfigTable& table) {
  std::vector<std::string> names;
  for (const Joint& joint : machine.joints) names.push_back(joint.name);
  const std::string name = table.choice("joint", names);
  return static_cast<int>(std::find(names.begin(), names.end(), name) - names.begin());
}

struct ColumnBounds {
  double unit, value_max, slope_max;
};

Spline read_column(const ConfigTable& table, const std::string& key, const ColumnBounds& column,
                   const std::vector<double>& places, bool periodic) {
  if (!table.has(key)) return {};
  std::vector<double> values = table.numbers(key);
  if (values.size() != places.size())
    throw table.error(key,
                      fmt::format("{} values, but the table has {} places", values.size(), places.size()));
  for (double& value : values) {
    if (std::abs(value) > column.value_max)
      throw table.error(key, fmt::format("'{}' has {:g}; -{:g} to {:g} is legal", key, value,
                                         column.value_max, column.value_max));
    value *= column.unit;
  }
  Spline curve;
  try {
    curve = periodic ? Spline::periodic(places, values) : Spline(places, values);
  } catch (const std::invalid_argument& bad) {
    throw table.error(key, bad.what());
  }
  if (curve.slope_max() > column.slope_max)
    throw table.error(key,
                      fmt::format("the smooth curve through '{}' is steeper than any real axis; check the "
                                  "unit, and whether two places lie too close together",
                                  key));
  return curve;
}

ErrorTables read_tables(const ConfigTable& table, JointKind kind) {
  const bool rotary = kind == JointKind::kRotary;
  const char* at = rotary ? "at_deg" : "at_mm";
  std::vector<double> places = table.numbers(at);
  for (double& place : places) place *= rotary ? kRadPerDeg : 1;
  // An error table that goes back on itself has two values at a place; equal places would divide by nothing
  // in the spline.
  if (places.empty() ||
      std::adjacent_find(places.begin(), places.end(), std::greater_equal<>()) != places.end())
    throw table.error(at, "the places of a table must rise");
  const bool periodic = rotary && table.boolean("periodic", false);
  // A C axis that turns on and on meets its first place again after a whole turn. The last column of the
  // table must be that place, or the spline would stretch the turn.
  if (periodic && std::abs(places.back() - places.front() - 2 * kPi) > 1e-9)
    throw table.error(at, "the places of a periodic table must span 360 degrees");
  const Steepest& steepest = rotary ? kRotarySteepest : kLinearSteepest;
  ErrorTables out;
  for (std::size_t i = 0; i < 3; ++i) {
    out.offset[i] = read_column(table, fmt::format("e{}_mm", kOffsets[i]), {1, kOffsetMax, steepest.offset},
                                places, periodic);
    out.tilt[i] = read_column(table, fmt::format("e{}_arcsec", kTurns[i]),
                              {kRadPerArcsec, kTiltMaxArcsec, steepest.tilt}, places, periodic);
  }
  return out;
}

}  // namespace

void read_axis_errors(const Machine& machine, const ConfigTable& section, ActualChain& chain) {
  std::vector<int> seen;
  for (const ConfigTable& table : section.tables_if("axis")) {
    const int joint = joint_of(machine, table);
    if (std::find(seen.begin(), seen.end(), joint) != seen.end())
      throw table.error("joint", "this axis has its errors already");
    seen.push_back(joint);
    ActualAxis& axis = *find_axis(chain, joint);
    const Range mm{-kOffsetMax, kOffsetMax}, arcsec{-kTiltMaxArcsec, kTiltMaxArcsec};
    for (int i = 0; i < 3; ++i) {
      axis.location.offset[i] = table.number(fmt::format("e{}0_mm", kOffsets[i]), 0, mm);
      axis.location.tilt[i] = kRadPerArcsec * table.number(fmt::format("e{}0_arcsec", kTurns[i]), 0, arcsec);
    }
    axis.tables.clear();
    if (const auto errors = table.table_if("table")) axis.tables.push_back(read_tables(*errors, axis.kind));
  }
}

GeometricConfig read_geometric(const Machine& machine, const ConfigTable& section) {
  GeometricConfig config;
  config.chain = read_chain(machine);
  config.mode = section.choice("mode", {"position", "full"}, "full") == "full" ? GeometricMode::kFull
                                                                               : GeometricMode::kPosition;
  config.chain.model = section.choice("model", {"linear", "exact"}, "linear") == "exact" ? TiltModel::kExact
                                                                                         : TiltModel::kLinear;
  config.limit_mm = section.number("limit_mm", config.limit_mm, Range{1e-3, 50});
  config.limit_rad = kRadPerDeg * section.number("limit_deg", 1.0, Range{1e-3, 10});
  read_axis_errors(machine, section, config.chain);
  return config;
}

}  // namespace trn
