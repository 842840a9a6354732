#pragma once

#include <chrono>
#include <mutex>
#include <string>
#include <vector>

#include "core/safe_file.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"

namespace trn {

/// Files of what a machine must not forget; "": kept in memory only.
struct MemoryFiles {
  std::string vars;       ///< numbered parameters: offsets, the tool in the spindle, the user's own (.var)
  std::string tools;      ///< the tool table (.tbl)
  std::string logs = {};  ///< folder of what programs write themselves, by (LOGOPEN,)
};

/// What programs leave behind, and its files. Whoever runs a program's lines calls `keep` behind each of
/// them, before anything that the line made can act; never in the tick.
class MachineMemory {
 public:
  /// `parameters` and `tools` are as in the files, and must outlive this.
  MachineMemory(Parameters& parameters, ToolTable& tools, MemoryFiles files);

  /// What has changed is on the disk when this returns: offsets, homes, the tool in the spindle and the tool
  /// table always; the user's own parameters with `all`, else only if kSlack_s has passed since the last
  /// time, for a loop may count with them. FileError if it cannot be written: then parameters and tools are
  /// again as they were last kept.
  void keep(bool all);

  /// A tool for people, from any thread: "tool 2 (8 mm ball)", "no tool" for 0.
  std::string tool_name(int number) const;
  /// Of all tools of the table.
  std::map<int, std::string> tool_names() const;

  static constexpr double kSlack_s = 0.2;

 private:
  using Clock = std::chrono::steady_clock;
  struct Range {
    int first, last;
  };
  static const Range kMachine[], kUser[];

  template <std::size_t n>
  bool differs(const Range (&ranges)[n]) const;
  void restore_parameters();
  void keep_parameters(bool all);
  void keep_tools();

  Parameters& parameters_;
  ToolTable& tools_;
  MemoryFiles files_;
  std::vector<double> kept_;  ///< values of #0 to parameter::kMachineLast
  bool touched_ = false;
  Clock::time_point kept_at_{};
  mutable std::mutex mutex_;  ///< of kept_tools_
  ToolTable kept_tools_;
};

}  // namespace trn
