#pragma once

#include <optional>

#include "app/session/assembly.h"
#include "app/session/session_log.h"
#include "core/fault.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/rt_messages.h"

namespace trn {

struct ReplayResult {
  std::uint64_t periods = 0;
  std::uint32_t starvations = 0;
  Fault fault = Fault::kOk;         ///< latched at the end
  std::optional<SessionEntry> gap;  ///< where the log is not whole, so that nothing is known from `since` on
};

/// Runs a session again without drives and without a clock: every entry acts in its own period, programs are
/// planned anew, and where the tick once had little motion ahead it sees just as many blocks again. `sink`
/// gets every report in which the drives are powered, as the daemon's record does. What a program read ahead
/// of a stop has done to parameters is not known to a log, so a session that stops programs and then runs
/// others on their parameters may part from it there. ProgramError as Pipeline, and where the
/// log has joints, corrections or sensors that the machine does not have. Ends where the log has a gap.
ReplayResult replay(const Session& session, const Assembly& assembly, Parameters& parameters,
                    ToolTable& tools, ReportSink& sink);

}  // namespace trn
