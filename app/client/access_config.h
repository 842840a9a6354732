#pragma once

#include <string>

#include "core/config.h"

namespace trn {

/// Section [access] of the config.
struct AccessConfig {
  std::string
      socket;  ///< path of the daemon's socket; "": in the first folder of lock_folders() that will do
  std::string look = "trunnion";  ///< group whose members may connect, and look
  std::string operate;            ///< group whose members may also operate; "": all who may look
  std::string set_up;             ///< group whose members may also set up; "": all who may operate
};

/// ConfigError as ConfigTable; the section may be missing.
AccessConfig read_access(const ConfigTable& root);

}  // namespace trn
