#include "sim/canopen/fault_script.h"

#include <algorithm>

#include "core/config.h"
#include "hal/can/nmt.h"

namespace trn {

namespace {

FaultScript::DeviceEvent read_device_event(const ConfigTable& table) {
  FaultScript::DeviceEvent event;
  event.at_s = table.number("at_s", kNotNegative);
  event.device = table.text("device");
  const std::string kind = table.choice("kind", {"silent", "short", "slow", "lie", "good"});
  const auto value = static_cast<int>(table.integer("value", 1, Range{-32768, 32767}));
  event.trouble.silent = kind == "silent";
  event.trouble.is_short = kind == "short";
  if (kind == "slow") event.trouble.late_ms = std::max(value, 0);
  if (kind == "lie") event.trouble.lie = value;
  return event;
}

FaultScript::Event read_event(const ConfigTable& table) {
  static const std::vector<std::string> kKinds = {
      // as EmulatedNode::Trouble
      "silent",         "reset", "emergency", "fault",           "no_heartbeat",
      "heartbeat_late", "drop",  "duplicate", "reorder",         "short_pdo",
      "refuse",         "slow",  "lie",       "pre_operational", "ignore",
      "quiet_fault",    "held",  "sto",       "inputs"};
  FaultScript::Event event;
  event.at_s = table.number("at_s", kNotNegative);
  event.bus = static_cast<std::size_t>(table.integer("bus", 0, Range{0, 7}));
  event.node = static_cast<int>(table.integer("node", Range{1, kNodeIdMax}));
  const std::string kind = table.choice("kind", kKinds);
  event.kind =
      static_cast<EmulatedNode::Trouble>(std::find(kKinds.begin(), kKinds.end(), kind) - kKinds.begin());
  event.value = table.integer("value", 1, kAnyNumber);
  return event;
}

}  // namespace

FaultScript read_fault_script(const std::string& path) { return read_fault_script(load_config(path)); }

FaultScript read_fault_script(const ConfigTable& root) {
  FaultScript script;
  for (const ConfigTable& table : root.tables_if("fault"))
    if (table.has("device"))
      script.device_events.push_back(read_device_event(table));
    else
      script.events.push_back(read_event(table));
  root.finish();
  return script;
}

void FaultScript::run(std::vector<std::unique_ptr<EmulatedNode>>& nodes, std::size_t bus,
                      std::int64_t since_begin_ns, std::int64_t now_ns) {
  for (Event& event : events) {
    // Once each, in the first turn at or behind its time.
    if (event.done || event.bus != bus || event.at_s * 1e9 > static_cast<double>(since_begin_ns)) continue;
    event.done = true;
    for (auto& node : nodes)
      if (node->id() == event.node) node->trouble(event.kind, event.value, now_ns);
  }
}

void FaultScript::run(EmulatedCabinet& cabinet, std::int64_t since_begin_ns) {
  for (DeviceEvent& event : device_events) {
    if (event.done || event.at_s * 1e9 > static_cast<double>(since_begin_ns)) continue;
    event.done = true;
    cabinet.trouble(event.device, event.trouble);
  }
}

}  // namespace trn
