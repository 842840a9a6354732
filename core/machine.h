#pragma once

#include <string>

#include "core/axes.h"
#include "core/config.h"

namespace trn {

/// What every part needs to know of the machine: its name, period and motor joints. Each part reads its own
/// section from `root`; whoever assembles the machine calls `root.finish()` at the end.
struct Machine {
  ConfigTable root;
  std::string name;
  double period_s = 0;
  Joints joints;
};

/// Reads [machine] and [[joint]]; ConfigError as ConfigTable.
Machine read_machine(const ConfigTable& root);

}  // namespace trn
