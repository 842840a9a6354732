#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "sim/canopen/emulated_node.h"

namespace trn {

/// What goes wrong with emulated drives, and when.
struct FaultScript {
  struct Event {
    double at_s = 0;
    std::size_t bus = 0;
    int node = 0;
    EmulatedNode::Trouble kind = EmulatedNode::Trouble::kSilent;
    std::int64_t value = 1;
    bool done = false;
  };
  std::vector<Event> events;

  /// Lets happen what is due on this bus, once.
  void run(std::vector<std::unique_ptr<EmulatedNode>>& nodes, std::size_t bus, std::int64_t since_begin_ns,
           std::int64_t now_ns);
};

/// TOML, [[fault]] with at_s, node, kind, and bus (0) and value (1); ConfigError as ConfigTable.
FaultScript read_fault_script(const std::string& path);

}  // namespace trn
