#include "app/lab/measuring_run.h"

#include <fmt/format.h>

#include <stdexcept>

#include "app/session/simulation.h"
#include "core/fault.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"

namespace trn {

void run_measurement(Assembly& assembly, const std::string& program_path, ReportSink& reader,
                     const std::string& what) {
  SimulationOptions options;
  options.program = program_path;
  options.trace = &reader;
  Parameters parameters;
  ToolTable tools;
  const SimulationResult result = simulate(assembly, parameters, tools, options);
  if (result.fault != Fault::kOk)
    throw std::runtime_error(fmt::format("{}: fault {}", what, fault_info(result.fault).name));
  if (!result.within_limits) throw std::runtime_error(what + ": a joint left its limits");
}

}  // namespace trn
