#pragma once

#include <functional>

#include "app/client/access_config.h"
#include "app/client/gateway_config.h"
#include "hal/lcm_link.h"

namespace trn {

struct GatewayParts {
  LcmConfig names;  ///< the names of the channels
  AccessConfig access;
  GatewayConfig gateway;
};

/// Listens to the group of `gateway.url` and talks to the daemon over its socket, until SIGTERM or SIGINT. A
/// daemon that is gone is looked for again. `confine` is called once all files and sockets are open, before
/// anything is received; afterwards the process connects to the daemon's socket again, writes the counters'
/// folder and the log, and does nothing else. std::runtime_error or KeyError with what is wrong and how to
/// mend it.
void run_gateway(const GatewayParts& parts,
                 const std::function<void(const std::string& counters_folder)>& confine);

}  // namespace trn
