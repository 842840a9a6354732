#include "sim/canopen/fault_script.h"

#include <algorithm>

#include "core/config.h"
#include "hal/can/nmt.h"

namespace trn {

FaultScript read_fault_script(const std::string& path) {
  static const std::vector<std::string> kKinds = {
      // as EmulatedNode::Trouble
      "silent",  "reset",     "emergency", "fault", "no_heartbeat", "heartbeat_late", "drop", "duplicate",
      "reorder", "short_pdo", "refuse",    "slow",  "lie",          "pre_operational"};
  const ConfigTable root = load_config(path);
  FaultScript script;
  for (const ConfigTable& table : root.tables_if("fault")) {
    FaultScript::Event event;
    event.at_s = table.number("at_s", kNotNegative);
    event.bus = static_cast<std::size_t>(table.integer("bus", 0, Range{0, 7}));
    event.node = static_cast<int>(table.integer("node", Range{1, kNodeIdMax}));
    const std::string kind = table.choice("kind", kKinds);
    event.kind =
        static_cast<EmulatedNode::Trouble>(std::find(kKinds.begin(), kKinds.end(), kind) - kKinds.begin());
    event.value = table.integer("value", 1, kAnyNumber);
    script.events.push_back(event);
  }
  root.finish();
  return script;
}

void FaultScript::run(std::vector<std::unique_ptr<EmulatedNode>>& nodes, std::size_t bus,
                      std::int64_t since_begin_ns, std::int64_t now_ns) {
  for (Event& event : events) {
    if (event.done || event.bus != bus || event.at_s * 1e9 > static_cast<double>(since_begin_ns)) continue;
    event.done = true;
    for (auto& node : nodes)
      if (node->id() == event.node) node->trouble(event.kind, event.value, now_ns);
  }
}

}  // namespace trn
