#pragma once

#include <cstdio>
#include <memory>
#include <string>

#include "core/machine.h"
#include "core/ports.h"
#include "kernel/joint_map.h"
#include "kernel/rt_messages.h"
#include "kernel/setpoint_chain.h"

namespace trn {

/// Writes the setpoint stream as CSV: a header, then one row a period with t_s, the motor joints by name (mm,
/// rad), the tip p_x, p_y, p_z (mm) and tool axis u_i, u_j, u_k in the work frame, and the source line; 17
/// significant digits. On a machine that estimates the tool's load follow force.X, force.Y (N, on the tool),
/// deflection.X, deflection.Y (mm, of its tip) and load_known (0 or 1; 2: alarm), all along the joints; with
/// `corrections`, what every correction of the chain adds to every joint, in columns NAME.JOINT. Rows before
/// the first motion and after the last are left out where nothing changes. With `pieces`, a last column
/// `piece` counts the pieces between which the drives had no power (quick stop, homing, reset): the rows of
/// one follow each other in time, and the first one without power repeats the last setpoints.
class TraceWriter final : public ReportSink {
 public:
  /// OutputError if the file cannot be written.
  TraceWriter(const std::string& path, const Machine& machine, const MachineJointMap& map,
              const SetpointChain& chain, bool corrections = false, bool pieces = false);

  void write(const CycleReport& report) override;
  void power_lost() override;
  /// Flushes; OutputError if anything could not be written.
  void close();

 private:
  struct Close {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  void row(const CycleReport& report);
  void emit(std::uint64_t period);
  void append_corrections(const CycleReport& report);
  void append_tool_load(const ToolLoadReport& load);

  std::string path_;
  const MachineJointMap& map_;
  const SetpointChain& chain_;
  bool corrections_, pieces_;  ///< with their columns
  double period_s_;
  std::unique_ptr<std::FILE, Close> file_;
  std::unique_ptr<CycleReport> standing_;  ///< last report while nothing moves
  std::uint64_t first_period_ = 0, last_period_ = 0, piece_ = 0;
  bool any_ = false, without_power_ = false;
  std::string text_;
};

}  // namespace trn
