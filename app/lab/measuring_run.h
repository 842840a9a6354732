#pragma once

#include <string>

#include "app/session/assembly.h"
#include "kernel/rt_messages.h"

namespace trn {

/// Runs a program on the simulated machine while `reader` looks at every period. std::runtime_error "WHAT:
/// why" where a fault ends it or a joint leaves its limits: what was read then is no measurement.
void run_measurement(Assembly& assembly, const std::string& program_path, ReportSink& reader,
                     const std::string& what);

}  // namespace trn
