#pragma once

#include <atomic>
#include <string>

#include "app/client/access_config.h"
#include "hal/lcm_link.h"

namespace trn {

/// Where a machine's state is told over MQTT, and as whom.
struct MqttConfig {
  std::string host = "127.0.0.1";
  int port = 0;                ///< 0: 1883, with TLS 8883
  std::string authority_file;  ///< certificates of who signed the broker's, PEM; "": without TLS
  std::string user;            ///< "": without a log-in
  std::string password;
  std::string prefix = "trunnion";
  double motion_hz = 1;  ///< how often positions are told; 0: never
};

/// Tells the state of the daemon's machine until `stop` is true, and hears nothing. It connects again by
/// itself. std::runtime_error where the settings cannot work, as a password without TLS on a network.
void publish_over_mqtt(const MqttConfig& config, const LcmConfig& lcm, const AccessConfig& access,
                       const std::atomic<bool>& stop);

}  // namespace trn
