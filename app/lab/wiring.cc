#include "app/lab/wiring.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>

#include "app/lab/picture/colours.h"
#include "app/lab/picture/svg.h"
#include "app/session/signal_config.h"
#include "core/config.h"
#include "core/machine.h"
#include "core/signal_name.h"
#include "kernel/safety_inputs.h"

namespace trn {

namespace {

using picture::Box;
using picture::Px;
using picture::Svg;

constexpr double kWireWidth = 900, kWireTop = 70, kWireRow = 46, kWireBox = 270, kWireMargin = 24,
                 kWireBoxHeight = 30;

/// Names of what hangs on [io], where a field bus has one.
class EndNames {
 public:
  explicit EndNames(const Machine& machine) : machine_(machine) {
    const std::optional<ConfigTable> io = machine.root.table_if("io");
    if (!io || !io->has("digital_inputs") || !io->has("digital_outputs")) return;
    inputs_ = io->texts("digital_inputs", {});
    outputs_ = io->texts("digital_outputs", {});
  }
  std::string spelt(const SignalName& name) const {
    const std::string plain = to_string(name, machine_);
    const auto& names = name.is_input() ? inputs_ : outputs_;
    const auto number = static_cast<std::size_t>(name.number);
    return name.of_io() && number < names.size() ? fmt::format("{} ({})", plain, names[number]) : plain;
  }

 private:
  const Machine& machine_;
  std::vector<std::string> inputs_, outputs_;
};

std::string milliseconds(double time_s) {
  return time_s < 1 ? fmt::format("{:g} ms", 1000 * time_s) : fmt::format("{:g} s", time_s);
}

std::string how_text(bool inverted, double debounce_s, double delay_s) {
  std::string out = inverted ? "inverted" : "";
  const auto add = [&](const std::string& text) { out += (out.empty() ? "" : ", ") + text; };
  if (debounce_s > 0) add(milliseconds(debounce_s) + " debounce");
  if (delay_s > 0) add("on after " + milliseconds(delay_s));
  return out;
}

void add_safety(const Assembly& assembly, const EndNames& names, std::vector<WireRow>& rows) {
  constexpr const char* kKinds[] = {"emergency stop", "enable", "door", "air"};  // as SafetyKind
  for (const SafetyInputs::Input& input : assembly.safety) {
    const double debounce_s = input.debounce_periods * assembly.machine.period_s;
    std::string how = how_text(false, debounce_s, 0);
    how = fmt::format("safe when {}{}{}", input.safe_when_on ? "on" : "off", how.empty() ? "" : ", ", how);
    rows.push_back({WireRow::Kind::kSafety, kKinds[static_cast<std::size_t>(input.kind)],
                    names.spelt(input.from),
                    fmt::format("fault {}", fault_info(SafetyInputs::fault_of(input.kind)).name), how});
  }
}

void add_brakes(const Machine& machine, const EndNames& names, std::vector<WireRow>& rows) {
  const std::optional<ConfigTable> safety = machine.root.table_if("safety");
  if (!safety) return;
  for (const ConfigTable& brake : safety->tables_if("brake")) {
    const bool inverted = brake.has("released_by") && brake.text("released_by") == "off";
    rows.push_back(
        {WireRow::Kind::kBrake, "brake of " + brake.text("joint"), "drive of " + brake.text("joint"),
         names.spelt(read_signal_name(machine, brake, "output")),
         fmt::format("{}free after {}, holds after {}", inverted ? "inverted, " : "",
                     milliseconds(brake.number("release_s")), milliseconds(brake.number("close_s")))});
  }
}

// What [io] has on values of devices on a field bus, by the roles that the values have.
void add_field_bus(const Machine& machine, std::vector<WireRow>& rows) {
  const std::optional<ConfigTable> io = machine.root.table_if("io");
  if (!io || io->text("type", "") != "modbus") return;
  const auto row = [&](const std::string& name, const std::string& from, const std::string& to) {
    rows.push_back({WireRow::Kind::kFieldBus, name, from, to, ""});
  };
  if (const std::optional<ConfigTable> spindle = io->table_if("spindle")) {
    for (const char* key : {"speed", "run", "reverse"})
      if (spindle->has(key)) row("spindle", fmt::format("spindle {}", key), spindle->text(key));
    for (const char* key : {"actual", "at_speed", "fault"})
      if (spindle->has(key)) row("spindle", spindle->text(key), fmt::format("spindle {}", key));
  }
  for (const char* key : {"mist", "flood"})
    if (io->has(key)) row("coolant", key, io->text(key));
  for (const char* kind : {"", "analog_"})
    for (const bool input : {true, false}) {
      const std::string key = fmt::format("{}{}s", *kind ? kind : "digital_", input ? "input" : "output");
      const std::vector<std::string> values = io->has(key) ? io->texts(key, {}) : std::vector<std::string>{};
      for (std::size_t i = 0; i < values.size(); ++i) {
        const std::string port = fmt::format("io.{}{}.{}", kind, input ? "input" : "output", i);
        row("field bus", input ? values[i] : port, input ? port : values[i]);
      }
    }
}

// [[io.wire]], and the same below [io.emulation].
void add_simulated(const Machine& machine, std::vector<WireRow>& rows) {
  std::optional<ConfigTable> io = machine.root.table_if("io");
  if (io && io->has("emulation")) io = io->table_if("emulation");
  if (!io) return;
  for (const ConfigTable& wire : io->tables_if("wire")) {
    const bool analog = wire.has("analog_input");
    const char* stem = analog ? "analog_" : "";
    const long output = analog ? wire.integer("analog_output") : wire.integer("output");
    const long input = analog ? wire.integer("analog_input") : wire.integer("input");
    rows.push_back({WireRow::Kind::kSimulated, "simulated", fmt::format("io.{}output.{}", stem, output),
                    fmt::format("io.{}input.{}", stem, input),
                    how_text(false, 0, wire.has("delay_s") ? wire.number("delay_s") : 0)});
  }
}

const char* colour_of(WireRow::Kind kind) {
  switch (kind) {
    case WireRow::Kind::kSignal:
      return picture::line_colour(0);
    case WireRow::Kind::kSafety:
      return picture::line_colour(1);
    case WireRow::Kind::kBrake:
      return picture::line_colour(2);
    case WireRow::Kind::kFieldBus:
      return picture::line_colour(3);
    case WireRow::Kind::kSimulated:
      break;
  }
  return picture::kNeutral;
}

void draw_end(Svg& svg, double left, double middle, const std::string& text) {
  svg.frame(Box{left, middle - kWireBoxHeight / 2, kWireBox, kWireBoxHeight});
  svg.text(left + kWireBox / 2, middle + 4, text, {.anchor = "middle", .room_px = kWireBox - 12});
}

void draw_arrow(Svg& svg, Px from, Px to, const char* colour) {
  svg.line(from, to, colour, 2);
  for (const double side : {-5.0, 5.0}) svg.line(to, {to.x - 9, to.y + side}, colour, 2);
}

}  // namespace

std::vector<WireRow> wiring_of(const Assembly& assembly) {
  const EndNames names(assembly.machine);
  std::vector<WireRow> rows;
  for (const NamedWire& signal : assembly.signals)
    rows.push_back({WireRow::Kind::kSignal, signal.name, names.spelt(signal.wire.from),
                    names.spelt(signal.wire.to),
                    how_text(signal.wire.invert, signal.debounce_s, signal.delay_s)});
  add_safety(assembly, names, rows);
  add_brakes(assembly.machine, names, rows);
  add_field_bus(assembly.machine, rows);
  add_simulated(assembly.machine, rows);
  return rows;
}

std::string wiring_svg(const std::string& machine, const std::vector<WireRow>& rows) {
  Svg svg(kWireWidth, kWireTop + kWireRow * static_cast<double>(std::max<std::size_t>(rows.size(), 1)));
  svg.text(kWireMargin, 28, fmt::format("wiring of {}", machine), {.size = 15, .bold = true});
  if (rows.empty()) svg.text(kWireMargin, kWireTop, "nothing is wired");
  double y = kWireTop;
  for (const WireRow& row : rows) {
    const double left = kWireMargin + kWireBox + 4, right = kWireWidth - kWireMargin - kWireBox - 4;
    draw_end(svg, kWireMargin, y, row.from);
    draw_end(svg, kWireWidth - kWireMargin - kWireBox, y, row.to);
    draw_arrow(svg, {left, y}, {right, y}, colour_of(row.kind));
    const double room = right - left - 16;
    svg.text((left + right) / 2, y - 5, row.name, {.anchor = "middle", .bold = true, .room_px = room});
    svg.text((left + right) / 2, y + 15, row.how, {.anchor = "middle", .size = 11, .room_px = room});
    y += kWireRow;
  }
  return svg.str();
}

}  // namespace trn
