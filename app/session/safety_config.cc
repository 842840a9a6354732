#include "app/session/safety_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>

#include "app/session/make_drives.h"
#include "core/config.h"
#include "core/periods.h"
#include "core/signal_name.h"

namespace trn {

namespace {

SafetyInputs::Input read_input(const Machine& machine, const ConfigTable& table) {
  static const std::vector<std::string> kSafetyKinds = {"emergency_stop", "enable", "door",
                                                        "air"};  // as SafetyKind
  SafetyInputs::Input input;
  const std::string kind = table.choice("kind", kSafetyKinds);
  input.kind = static_cast<SafetyKind>(std::find(kSafetyKinds.begin(), kSafetyKinds.end(), kind) -
                                       kSafetyKinds.begin());
  input.from = read_signal_name(machine, table, "from");
  if (!input.from.is_input()) throw table.error("from", "a safety input comes from an input");
  if (!input.from.of_drive() && !machine.root.has("io"))
    throw table.error("from", "the machine has no section [io], whose input this would be");
  if (input.from.of_drive() && drives_type(machine) != "canopen")
    throw table.error("from", "only drives with type = \"canopen\" have inputs; use one of [io]");
  input.safe_when_on = table.choice("safe_when", {"on", "off"}, "on") == "on";
  const double debounce_s = table.number("debounce_s", 0.0, Range{0, 1});
  input.debounce_periods = periods_of(debounce_s, machine.period_s);
  input.stops_jogs = !table.boolean("jog", false);
  return input;
}

}  // namespace

std::vector<SafetyInputs::Input> read_safety_inputs(const Machine& machine) {
  std::vector<SafetyInputs::Input> out;
  const std::optional<ConfigTable> safety = machine.root.table_if("safety");
  if (!safety) return out;
  // The drives' own reader knows what is in them.
  if (safety->has("brake") && drives_type(machine) != "canopen")
    throw safety->error("brake", "only drives with type = \"canopen\" have brakes that are operated");
  for (const ConfigTable& table : safety->tables_if("input")) {
    const SafetyInputs::Input input = read_input(machine, table);
    for (const SafetyInputs::Input& other : out)
      if (other.from == input.from && other.kind == input.kind)
        throw table.error("from", "this input is there already, of the same kind");
    out.push_back(input);
  }
  return out;
}

}  // namespace trn
