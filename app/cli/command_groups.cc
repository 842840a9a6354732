#include "app/cli/command_groups.h"

#include <array>
#include <string_view>
#include <vector>

namespace trn {

namespace {

struct Group {
  const char* name;
  std::vector<std::string_view> commands;
};

// In the order of the help. What stands in none is shown under "More", behind them.
const std::array kGroups = {
    Group{"Try a program on this computer", {"run", "interpret", "check-trace", "replay"}},
    Group{"Run a machine",
          {"daemon", "panel", "reset", "home", "jog", "wheel", "status", "monitor", "estop", "acknowledge"}},
    Group{"Cut a part",
          {"load", "start", "hold", "resume", "stop", "reverse", "forward", "override", "step", "switch",
           "mdi", "parts"}},
    Group{"Offsets, tools and corrections", {"offset", "touch-off", "tool", "correction", "sensor"}},
    Group{"Set up a machine",
          {"config", "import", "kin", "workspace", "io", "commission", "latency", "can", "modbus", "scope",
           "tune", "following"}},
    Group{"Make a machine accurate", {"ballbar", "ball", "joint-table", "micromill"}},
    Group{"Let other computers command and see", {"gateway", "key", "mqtt"}},
    Group{"This program", {"man", "completions"}},
};

}  // namespace

void sort_into_groups(CLI::App& app) {
  for (CLI::App* command : app.get_subcommands({})) {
    command->group("More");
    for (const Group& group : kGroups)
      for (const std::string_view name : group.commands)
        if (command->get_name() == name) command->group(group.name);
  }
}

std::size_t command_rank(const CLI::App& command) {
  std::size_t rank = 0;
  for (const Group& group : kGroups)
    for (const std::string_view name : group.commands)
      if (++rank; command.get_name() == name && command.get_group() == group.name) return rank;
  return rank + 1;
}

}  // namespace trn
