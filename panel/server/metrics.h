#pragma once

#include <cstddef>
#include <string>

#include "panel/server/daemon_watch.h"
#include "panel/server/panel_config.h"

namespace trn {

/// What GET /metrics answers, in Prometheus' text format 0.0.4: state, counters and timing of the machine.
/// `pages`: how many are open.
std::string metrics_text(const PanelConfig& config, const DaemonWatch& daemon, std::size_t pages);

}  // namespace trn
