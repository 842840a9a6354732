#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "app/client/access_config.h"
#include "core/machine.h"
#include "hal/lcm_link.h"
#include "panel/server/panel_key.h"
#include "panel/server/web_rules.h"

namespace trn {

/// What a panel serves, and where.
struct PanelConfig {
  Machine machine;
  std::string config_path;
  std::string version;
  ListenPlace listen;
  std::string page_folder;
  std::string programs_folder;  ///< a program that is loaded by its name alone lies here
  LcmConfig lcm;
  AccessConfig access;
  PanelKey key;
  nlohmann::json kinematics;  ///< what the page draws the machine of
  std::string own_program;    ///< plans the loaded program, as 'run --preview'
  bool print_key = true;      ///< behind the address
};

}  // namespace trn
