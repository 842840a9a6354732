#pragma once

#include <functional>
#include <string>

#include "app/check/limit_judge.h"
#include "core/axes.h"
#include "core/machine.h"

namespace trn {

/// What the independent checker of limits found in a trace.
struct TraceVerdict {
  double step_s = 0;      ///< between rows; the machine's period or a whole fraction of it
  double duration_s = 0;  ///< first to last row
  std::uint64_t rows = 0;
  std::uint64_t pieces =
      1;  ///< between them the drives had no power (column `piece`); each is judged by itself
  bool within_limits = false;
  std::vector<JointVerdict> joints;  ///< in the machine's order
};

/// Reads the trace at `path` ("-" is standard input) as a stream and judges it. TraceError when it is
/// damaged: not a trace, a joint without a column, a field that is no number, rows missing (the step
/// changes within a piece), cut off, or sampled more coarsely than the machine's period. `progress` is told
/// the row count now and then.
TraceVerdict check_trace(const std::string& path, const Machine& machine,
                         const std::function<void(std::uint64_t)>& progress);

/// A sentence for each figure that the recorded digits alone make doubtful.
std::vector<std::string> resolution_notes(const TraceVerdict& verdict, const Joints& joints);

/// The verdict as a table for people, and as JSON (mm, rad, s).
std::string verdict_table(const TraceVerdict& verdict, const Machine& machine, const std::string& trace);
std::string verdict_json(const TraceVerdict& verdict, const Machine& machine, const std::string& trace);

}  // namespace trn
