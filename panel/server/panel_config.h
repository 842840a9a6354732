#pragma once

#include <chrono>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "app/client/access_config.h"
#include "app/client/command_rights.h"
#include "core/machine.h"
#include "hal/lcm_link.h"
#include "panel/server/panel_key.h"
#include "panel/server/web_rules.h"

namespace trn {

/// How pages on a network reach a panel: over TLS, and after a log-in.
struct TlsConfig {
  std::string certificate_file;  ///< PEM, with the certificates between it and the root
  std::string key_file;          ///< of the certificate, PEM
  std::string users_file;
  std::chrono::seconds session_life{};
};

/// A machine whose daemon is on another computer: its gateway takes signed commands.
struct RemoteMachine {
  std::string group;     ///< url of the gateway's LCM group
  std::string key_file;  ///< private key of this panel
  std::string key_name;
  Role role = Role::kLook;  ///< that the config gives this key
};

/// A body of the machine as an STL file.
struct DrawnPart {
  std::string part;  ///< as Drawing has it
  std::string file;
};

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
  std::optional<PanelKey> key;          ///< with `tls`: of programs that look, as Prometheus does
  std::optional<RemoteMachine> remote;  ///< none: the daemon's socket on this computer
  std::optional<TlsConfig> tls;         ///< without it: the loopback only, and whoever has the key
  nlohmann::json kinematics;            ///< what the page draws the machine of
  std::vector<DrawnPart> drawings;      ///< what it draws instead
  std::string own_program;              ///< plans the loaded program, as 'run --preview'
  bool print_key = true;                ///< behind the address
  std::map<std::string, std::string> pages_of_others;  ///< addresses of other panels by machine
};

}  // namespace trn
