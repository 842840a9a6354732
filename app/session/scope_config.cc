#include "app/session/scope_config.h"

namespace trn {

ScopeConfig read_scope(const ConfigTable& root) {
  ScopeConfig config;
  const auto table = root.table_if("scope");
  if (!table) return config;
  config.seconds = table->number("seconds", config.seconds, Range{0.1, 600});
  config.after_fault_s = table->number("after_fault_s", config.after_fault_s, Range{0, 60});
  config.fault_files = static_cast<int>(table->integer("fault_files", config.fault_files, Range{0, 1000}));
  return config;
}

}  // namespace trn
