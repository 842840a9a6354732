#include "app/session/signal_config.h"

#include <fmt/format.h>

#include <optional>
#include <string>

#include "app/session/make_drives.h"
#include "core/config.h"
#include "core/periods.h"
#include "core/signal_name.h"

namespace trn {

namespace {

void check_end_is_there(const Machine& machine, const ConfigTable& table, const char* key,
                        const SignalName& name) {
  if (name.of_drive() && drives_type(machine) != "canopen")
    throw table.error(key, "only drives with type = \"canopen\" have inputs and outputs; use [io]");
  if (name.of_io() && !machine.root.has("io"))
    throw table.error(key, "the machine has no section [io], whose signal this would be");
}

// A brake is its drive's, and an output follows one wire alone.
void check_free(const Machine& machine, const ConfigTable& table, const SignalName& to,
                const std::vector<NamedWire>& others) {
  for (const NamedWire& other : others)
    if (other.wire.to == to)
      throw table.error("to", fmt::format("signal '{}' ends there already", other.name));
  const std::optional<ConfigTable> safety = machine.root.table_if("safety");
  if (!safety) return;
  for (const ConfigTable& brake : safety->tables_if("brake"))
    if (read_signal_name(machine, brake, "output") == to)
      throw table.error("to", "this output releases a brake, which its drive alone may do");
}

NamedWire read_signal(const Machine& machine, const ConfigTable& table) {
  NamedWire out;
  SignalWires::Wire& wire = out.wire;
  out.name = table.text("name");
  wire.from = read_signal_name(machine, table, "from");
  wire.to = read_signal_name(machine, table, "to");
  if (!wire.from.is_input() && wire.from.kind != SignalName::Kind::kMachine)
    throw table.error("from", "a signal comes from an input, or from a state of the machine");
  if (wire.to.kind == SignalName::Kind::kMachine || wire.to.kind == SignalName::Kind::kDriveInput)
    throw table.error("to", "a signal goes to an output, or to an input of [io] that programs read");
  if (wire.to == wire.from) throw table.error("to", "a signal that follows itself");
  check_end_is_there(machine, table, "from", wire.from);
  check_end_is_there(machine, table, "to", wire.to);
  wire.invert = table.boolean("invert", false);
  out.debounce_s = table.number("debounce_s", 0.0, Range{0, 10});
  out.delay_s = table.number("delay_s", 0.0, Range{0, 600});
  wire.debounce_periods = periods_of(out.debounce_s, machine.period_s);
  wire.delay_periods = periods_of(out.delay_s, machine.period_s);
  return out;
}

}  // namespace

std::vector<NamedWire> read_signals(const Machine& machine) {
  std::vector<NamedWire> out;
  for (const ConfigTable& table : machine.root.tables_if("signal")) {
    NamedWire signal = read_signal(machine, table);
    for (const NamedWire& other : out)
      if (other.name == signal.name) throw table.error("name", "this name is another signal's already");
    check_free(machine, table, signal.wire.to, out);
    out.push_back(std::move(signal));
  }
  return out;
}

}  // namespace trn
