#pragma once

#include <atomic>
#include <functional>
#include <thread>

#include "app/daemon/program_file.h"
#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "app/session/program_time.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"

namespace trn {

/// Finds out how long a program takes, in a thread of its own beside the one that drives it, and only with
/// what processor time nobody else wants.
class TimePass {
 public:
  explicit TimePass(const Assembly& assembly) : assembly_(assembly), files_(end_, assembly.program.words) {}
  ~TimePass() { end(); }
  TimePass(const TimePass&) = delete;
  TimePass& operator=(const TimePass&) = delete;

  /// `told` hears of it in that thread; not where it does not come to be known. Ends the one before.
  void begin(const ProgramStart& start, const Parameters& parameters, const ToolTable& tools,
             std::function<void(const ProgramTime&)> told);
  /// Nothing is told any more when this returns.
  void end();

 private:
  const Assembly& assembly_;
  std::atomic<bool> end_ = false;
  ProgramFiles files_;
  std::thread thread_;
};

}  // namespace trn
