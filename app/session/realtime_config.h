#pragma once

#include <optional>

#include "core/config.h"

namespace trn {

/// Section [realtime]; it may be missing.
struct RealtimeConfig {
  int priority = 80;                    ///< key `priority`: SCHED_FIFO, 1 to 98; 0: none asked for
  int cpu = -1;                         ///< key `cpu`: the tick's processor; -1: any
  bool lock_memory = true;              ///< key `lock_memory`
  std::optional<int> late_periods_max;  ///< key `late_periods_max`

  /// The tick may begin this many periods late before it is a fault; 0: never one. Unless the config says
  /// otherwise, late setpoints are a fault with real drives and harm nobody with simulated ones.
  int late_periods(bool real_drives) const { return late_periods_max.value_or(real_drives ? 5 : 0); }
};
RealtimeConfig read_realtime(const ConfigTable& root);

}  // namespace trn
