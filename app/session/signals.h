#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/axes.h"
#include "core/machine.h"
#include "kernel/rt_messages.h"
#include "kernel/setpoint_chain.h"

namespace trn {

/// One thing that can be watched every period.
struct Signal {
  std::string name;     ///< "X.measured"
  std::string unit;     ///< "mm", "deg/s", "N"; "" for numbers and switches
  std::string meaning;  ///< a sentence for people
  int column = 0;       ///< of the sampled row
  int bit = -1;         ///< of the column's whole number; -1: the column itself
  double scale = 1;     ///< from what the row holds to `unit`

  double value(const double* row) const;
};

/// All signals of a machine, and how the row of numbers is laid out that they are read from.
class SignalTable {
 public:
  /// `feedback_periods`: as Drives has it. `chain` null: no corrections.
  SignalTable(const Machine& machine, const SetpointChain* chain, int feedback_periods);

  const std::vector<Signal>& signals() const { return signals_; }
  std::size_t columns() const { return columns_; }
  std::size_t joints() const { return joints_; }
  std::size_t corrections() const { return corrections_; }
  std::size_t feedback_periods() const { return lag_; }
  double period_s() const { return period_s_; }
  /// Null if there is none of this name.
  const Signal* find(std::string_view name) const;

  /// What a row holds of each joint, and of the machine behind the joints and their corrections.
  enum JointColumn : std::uint8_t {
    kPlan,
    kSetpoint,
    kMeasured,
    kFollowing,
    kVelocity,
    kAcceleration,
    kMeasuredVelocity,
    kForce,
    kCurrent,
    kVelocityOffset,
    kForceOffset,
    kStatusWord,
    kControlWord,
    kJointColumns
  };
  enum MachineColumn : std::uint8_t {
    kLine,
    kRate,
    kSpeed,
    kMotion,
    kDrives,
    kFault,
    kSpindle,
    kSpindleTurns,
    kProbe,
    kCoolant,
    kInputsLow,
    kInputsHigh,
    kOutputsLow,
    kOutputsHigh,
    kWake,
    kTick,
    kMachineColumns
  };
  std::size_t joint_column(std::size_t joint, JointColumn column) const {
    return joint * kJointColumns + column;
  }
  std::size_t correction_column(std::size_t joint, std::size_t correction) const {
    return joints_ * kJointColumns + joint * corrections_ + correction;
  }
  std::size_t machine_column(MachineColumn column) const {
    return joints_ * (kJointColumns + corrections_) + column;
  }

 private:
  void add_joint(const Joint& joint, std::size_t index, const SetpointChain* chain);
  void add_machine();
  void add(std::string name, std::string unit, std::string meaning, std::size_t column, double scale = 1);
  void add_bits(std::string_view stem, std::string_view what, MachineColumn low, MachineColumn high);

  std::vector<Signal> signals_;
  std::size_t joints_, corrections_, lag_, columns_;
  double period_s_;
};

/// Makes rows of reports, one after the other.
class SignalSampler {
 public:
  explicit SignalSampler(const SignalTable& table) : table_(table) {}

  /// Fills `row`, which has the table's columns.
  void sample(const CycleReport& report, double* row);

 private:
  void begin(const CycleReport& report);
  void sample_joint(const CycleReport& report, std::size_t joint, double* row) const;
  void sample_machine(const CycleReport& report, double* row) const;

  static constexpr std::size_t kPastMax = 16;
  const SignalTable& table_;
  std::array<JointVec, kPastMax> setpoints_;  ///< newest first
  JointVec measured_;                         ///< in the period before
  std::uint64_t next_period_ = 0;
};

}  // namespace trn
