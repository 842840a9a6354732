#include "kernel/corrections.h"

#include "core/units.h"

namespace trn {

namespace {

/// A correction behind the plan: the name of its section and its maker.
struct SetpointKind {
  const char* name;
  std::unique_ptr<SetpointCorrection> (*make)(const Machine& machine, const ConfigTable& table);
};

// The order of this table is the order of the chain.
constexpr std::array<SetpointKind, 0> kSetpointKinds{};

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
  const std::optional<ConfigTable> section = machine.root.table_if("corrections");
  if (!section) return out;
  for (const SetpointKind& kind : kSetpointKinds)
    if (const auto table = section->table_if(kind.name))
      out.setpoint->append(read_budget(*table, kind.name), kind.make(machine, *table));
  return out;
}

}  // namespace trn
