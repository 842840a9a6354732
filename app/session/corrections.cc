#include "app/session/corrections.h"

#include <fmt/format.h>

#include <cmath>

#include "compensation/geometric.h"
#include "compensation/joint_tables.h"
#include "compensation/micromill/deflection_correction.h"
#include "compensation/screw_correction.h"
#include "core/axes.h"
#include "core/units.h"

namespace trn {

namespace {

constexpr int kScrewBit = 4, kDeflectionBit = 8;

void read_planned_geometry(const Machine& machine, const ConfigTable& table, Corrections& out) {
  const bool enabled = table.boolean("enabled", true);
  const double reserve = table.number("reserve", 0.002, Range{1e-4, 0.2});
  const GeometricConfig config = read_geometric(machine, table);
  if (!enabled) out.planned_off |= kGeometricBit;
  try {
    out.pose = std::make_unique<GeometricCorrection>(config);
  } catch (const std::invalid_argument& bad) {
    throw table.error("", bad.what());
  }
  out.setpoint->take_up_jumps(reserve);
}

/// The tables' own limit: what they add anywhere in the joints' ranges.
void check_tables(const Machine& machine, const ConfigTable& table, const std::vector<JointTable>& tables) {
  const double limit_mm = table.number("table_limit_mm", 10, kPositive);
  const double limit_deg = table.number("table_limit_deg", 1, kPositive);
  constexpr int kPlaces = 400;
  for (const JointTable& t : tables) {
    const Joint& joint = machine.joints[static_cast<std::size_t>(t.joint)];
    const bool rotary = joint.kind == JointKind::kRotary;
    const double limit = rotary ? limit_deg * kRadPerDeg : limit_mm, unit = rotary ? kDegPerRad : 1;
    for (int i = 0; i <= kPlaces; ++i) {
      const double q = joint.limit.min + (joint.limit.max - joint.limit.min) * i / kPlaces;
      if (std::abs(t.correction(q)) > limit)
        throw table.error(rotary ? "table_limit_deg" : "table_limit_mm",
                          fmt::format("the table of joint {} adds {:.4g} at {:.4g}, more than {:g}",
                                      joint.name, unit * t.correction(q), unit * q, unit * limit));
    }
  }
}

/// What acts on reversal is half of the gap, to either side; `limit_mm` would cut off what is more.
void check_gaps(const Machine& machine, const ConfigTable& table, const std::vector<JointTable>& tables,
                const SetpointBudget& budget) {
  for (const JointTable& t : tables) {
    const Joint& joint = machine.joints[static_cast<std::size_t>(t.joint)];
    const bool rotary = joint.kind == JointKind::kRotary;
    const double limit = rotary ? budget.limit_rad : budget.limit_mm, unit = rotary ? kDegPerRad : 1;
    const double half = t.backlash / 2 + t.half_gap.peak();
    if (half <= limit * (1 + 1e-9)) continue;
    const char* name = rotary ? "deg" : "mm";
    throw table.error(
        fmt::format("limit_{}", name),
        fmt::format(
            "the gap of joint {} asks for {:.4g} {} to either side, but 'limit_{}' is {:.4g}; the largest "
            "gap that it takes is {:.4g} {}",
            joint.name, unit * half, name, name, unit * limit, 2 * unit * limit, name));
  }
}

void read_tables(const Machine& machine, const ConfigTable& table, Corrections& out) {
  const std::vector<JointTable> tables = read_joint_tables(machine, table);
  check_tables(machine, table, tables);
  SetpointBudget budget = read_budget(table, "backlash");
  check_gaps(machine, table, tables, budget);
  budget.bit = kJointTableBit;
  if (!budget.enabled) out.planned_off |= kJointTableBit;
  out.joint = std::make_unique<JointTables>(tables);
  auto backlash = std::make_unique<BacklashCorrection>(tables);
  if (backlash->joint_mask() != 0) out.setpoint->append(budget, std::move(backlash));
}

void read_screw_growth(const Machine& machine, const ConfigTable& table, Corrections& out) {
  const ScrewCorrectionConfig config = read_screws(machine, table, *out.sensors);
  SetpointBudget budget = read_budget(table, "screw");
  budget.bit = kScrewBit;
  if (config.screws.empty()) return;
  auto screws = std::make_unique<ScrewCorrection>(config, *out.sensors);
  out.background.emplace_back([screw = screws.get()] { screw->work(); });
  out.setpoint->append(budget, std::move(screws));
}

void read_deflection_estimate(const Machine& machine, const ConfigTable& table, Corrections& out) {
  const DeflectionCorrection::Config config = read_deflection(table, machine.period_s);
  SetpointBudget budget = read_budget(table, "deflection");
  budget.bit = kDeflectionBit;
  if (machine.joints.size() < 2)
    throw table.error("", "the tool's deflection needs a stage whose first two joints are X and Y");
  out.setpoint->append_deflection(budget, std::make_unique<DeflectionCorrection>(config));
}

/// A correction: the name of its section, and who reads it.
struct CorrectionKind {
  const char* name;
  int bit;  ///< in a program's switch
  void (*read)(const Machine& machine, const ConfigTable& table, Corrections& out);
};

// The order of this table is the order of the chain.
constexpr CorrectionKind kKinds[] = {
    {"geometric", kGeometricBit, read_planned_geometry},
    {"joint_table", kJointTableBit, read_tables},
    {"screw", kScrewBit, read_screw_growth},
    {"deflection", kDeflectionBit, read_deflection_estimate},
};

}  // namespace

SetpointBudget read_budget(const ConfigTable& table, const char* name) {
  SetpointBudget budget;
  budget.name = name;
  budget.enabled = table.boolean("enabled", true);
  budget.limit_mm = table.number("limit_mm", 0.1, Range{1e-6, 10});
  budget.limit_rad = kRadPerDeg * table.number("limit_deg", 0.01, Range{1e-6, 5});
  budget.reserve = table.number("reserve", budget.reserve, Range{1e-4, 0.2});
  return budget;
}

std::vector<SwitchCode> read_switches(const ConfigTable& root, const ProgramConfig& program) {
  ProgramConfig known = program;
  const std::optional<ConfigTable> section = root.table_if("corrections");
  for (const CorrectionKind& kind : kKinds) {
    const auto table = section ? section->table_if(kind.name) : std::nullopt;
    for (const bool on : {true, false}) {
      const char* key = on ? "m_on" : "m_off";
      if (table && table->has(key)) known.switches.push_back({read_free_m(*table, key, known), on, kind.bit});
    }
  }
  return known.switches;
}

Corrections read_corrections(const Machine& machine) {
  Corrections out;
  out.sensors = std::make_unique<SensorBoard>();
  out.setpoint = std::make_unique<SetpointChain>(machine.joints, machine.period_s, out.sensors.get());
  const std::optional<ConfigTable> section = machine.root.table_if("corrections");
  if (!section) return out;
  for (const CorrectionKind& kind : kKinds)
    if (const auto table = section->table_if(kind.name)) kind.read(machine, *table, out);
  return out;
}

}  // namespace trn
