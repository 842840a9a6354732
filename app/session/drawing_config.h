#pragma once

#include <string>
#include <vector>

#include "core/config.h"
#include "core/machine.h"

namespace trn {

/// A body of the machine as its maker drew it, for pictures: an STL file in mm, in the machine's base frame,
/// where the body lies while every joint is at zero (of a machine with a platform: every word).
struct Drawing {
  std::string part;   ///< "base", "table", "spindle", or the joint that the body moves with
  std::string file;   ///< as it can be opened: a relative path begins at the config's folder
  ConfigTable table;  ///< where the config names it, for messages
};

/// [[drawing]] of a config; ConfigError where a part is none of the machine. The files are not opened: a
/// picture that is missing stops no machine.
std::vector<Drawing> read_drawings(const Machine& machine);

}  // namespace trn
