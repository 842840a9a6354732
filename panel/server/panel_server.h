#pragma once

#include <atomic>

#include "panel/server/panel_config.h"

namespace trn {

/// Serves pages until `stop` is true. std::runtime_error where the place cannot be listened at.
void serve_panel(const PanelConfig& config, const std::atomic<bool>& stop);

}  // namespace trn
