#include "app/session/realtime_config.h"

namespace trn {

RealtimeConfig read_realtime(const ConfigTable& root) {
  RealtimeConfig config;
  const auto section = root.table_if("realtime");
  if (!section) return config;
  config.priority = static_cast<int>(section->integer("priority", config.priority, Range{0, 98}));
  config.cpu = static_cast<int>(section->integer("cpu", config.cpu, Range{-1, CPU_SETSIZE - 1}));
  config.lock_memory = section->boolean("lock_memory", config.lock_memory);
  if (section->has("late_periods_max"))
    config.late_periods_max = static_cast<int>(section->integer("late_periods_max", Range{0, 1e6}));
  return config;
}

}  // namespace trn
