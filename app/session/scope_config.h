#pragma once

#include <string>

#include "core/config.h"

namespace trn {

/// Section [scope]; it may be missing.
struct ScopeConfig {
  double seconds = 10;       ///< key `seconds`: of all signals that the daemon keeps in memory
  double after_fault_s = 1;  ///< key `after_fault_s`: a fault's file ends so long behind it
  int fault_files = 10;      ///< key `fault_files`: that are kept; 0: none
};

/// ConfigError as ConfigTable.
ScopeConfig read_scope(const ConfigTable& root);

}  // namespace trn
