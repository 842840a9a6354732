#include "kernel/corrections.h"

#include "compensation/geometric.h"
#include "compensation/joint_tables.h"
#include "compensation/micromill/deflection_correction.h"
#include "compensation/screw_correction.h"
#include "core/units.h"

namespace trn {

namespace {

void read_planned_geometry(const Machine& machine, const ConfigTable& table, Corrections& out) {
  const bool enabled = table.boolean("enabled", true);
  const double reserve = table.number("reserve", 0.002, Range{1e-4, 0.2});
  const GeometricConfig config = read_geometric(machine, table);
  if (!enabled) return;
  try {
    out.pose = std::make_unique<GeometricCorrection>(config);
  } catch (const std::invalid_argument& bad) {
    throw table.error("", bad.what());
  }
  out.setpoint->take_up_jumps(reserve);
}

void read_tables(const Machine& machine, const ConfigTable& table, Corrections& out) {
  const std::vector<JointTable> tables = read_joint_tables(machine, table);
  const SetpointBudget budget = read_budget(table, "backlash");
  if (!budget.enabled) return;
  out.joint = std::make_unique<JointTables>(tables);
  auto backlash = std::make_unique<BacklashCorrection>(tables);
  if (backlash->joint_mask() != 0) out.setpoint->append(budget, std::move(backlash));
}

void read_screw_growth(const Machine& machine, const ConfigTable& table, Corrections& out) {
  const ScrewCorrectionConfig config = read_screws(machine, table, *out.sensors);
  const SetpointBudget budget = read_budget(table, "screw");
  if (config.screws.empty()) return;
  auto screws = std::make_unique<ScrewCorrection>(config, *out.sensors);
  out.background.emplace_back([screw = screws.get()] { screw->work(); });
  out.setpoint->append(budget, std::move(screws));
}

void read_deflection_estimate(const Machine& machine, const ConfigTable& table, Corrections& out) {
  const DeflectionCorrection::Config config = read_deflection(table, machine.period_s);
  const SetpointBudget budget = read_budget(table, "deflection");
  if (machine.joints.size() < 2)
    throw table.error("", "the tool's deflection needs a stage whose first two joints are X and Y");
  out.setpoint->append_deflection(budget, std::make_unique<DeflectionCorrection>(config));
}

/// A correction: the name of its section, and who reads it.
struct CorrectionKind {
  const char* name;
  void (*read)(const Machine& machine, const ConfigTable& table, Corrections& out);
};

// The order of this table is the order of the chain.
constexpr CorrectionKind kKinds[] = {
    {"geometric", read_planned_geometry},
    {"joint_table", read_tables},
    {"screw", read_screw_growth},
    {"deflection", read_deflection_estimate},
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

Corrections read_corrections(const Machine& machine) {
  Corrections out;
  out.setpoint = std::make_unique<SetpointChain>(machine.joints, machine.period_s);
  out.sensors = std::make_unique<SensorBoard>();
  const std::optional<ConfigTable> section = machine.root.table_if("corrections");
  if (!section) return out;
  for (const CorrectionKind& kind : kKinds)
    if (const auto table = section->table_if(kind.name)) kind.read(machine, *table, out);
  return out;
}

}  // namespace trn
