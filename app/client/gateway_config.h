#pragma once

#include <string>
#include <vector>

#include "app/client/command_rights.h"
#include "core/config.h"

namespace trn {

/// Section [gateway] of the config: what other hosts may send, signed, and where it is heard.
struct GatewayConfig {
  /// An entry of [[gateway.key]].
  struct Key {
    std::string name;         ///< whoever holds it, for messages and logs
    std::string public_text;  ///< the public key in base64, or the whole path of a file with it
    Role role = Role::kLook;
  };

  std::string url;          ///< the LCM group that is listened to; "": there is no gateway
  std::string counters;     ///< file for the last counter of each key; "": in the service's own folder
  double rate_hz_max = 50;  ///< commands a second of one key
  std::vector<Key> keys;
};

/// ConfigError as ConfigTable; the section may be missing. Reads no file.
GatewayConfig read_gateway(const ConfigTable& root);

}  // namespace trn
