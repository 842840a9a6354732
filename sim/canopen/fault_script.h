#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/config.h"
#include "sim/canopen/emulated_node.h"
#include "sim/modbus/emulated_cabinet.h"
#include "sim/modbus/emulated_line.h"

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
  /// A Modbus device.
  struct DeviceEvent {
    double at_s = 0;
    std::string device;
    EmulatedLine::Trouble trouble;
    bool done = false;
  };
  std::vector<Event> events;
  std::vector<DeviceEvent> device_events;

  /// Lets happen what is due on this bus, once.
  void run(std::vector<std::unique_ptr<EmulatedNode>>& nodes, std::size_t bus, std::int64_t since_begin_ns,
           std::int64_t now_ns);
  void run(EmulatedCabinet& cabinet, std::int64_t since_begin_ns);
};

/// TOML, [[fault]] with at_s, node, kind, and bus (0) and value (1); or with device instead of node, kind
/// silent, short, slow (value: ms), lie (value: added to its registers) or good. ConfigError as ConfigTable.
FaultScript read_fault_script(const std::string& path);
/// The same from the root table of such a file.
FaultScript read_fault_script(const ConfigTable& root);

}  // namespace trn
