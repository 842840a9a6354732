#include "app/session/signals.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>

#include "core/check.h"
#include "core/units.h"

namespace trn {

namespace {

constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
constexpr int kHalf = 32;  // bits of one column: a double holds 53

double at(const JointVec& values, Eigen::Index i) { return i < values.size() ? values[i] : kUnknown; }

double low_half(std::uint64_t bits) { return static_cast<double>(bits & 0xFFFFFFFFu); }
double high_half(std::uint64_t bits) { return static_cast<double>(bits >> kHalf); }

}  // namespace

double Signal::value(const double* row) const {
  const double held = row[column];
  if (bit < 0) return scale * held;
  return static_cast<double>(static_cast<std::uint64_t>(held) >> bit & 1u);
}

SignalTable::SignalTable(const Machine& machine, const SetpointChain* chain, int feedback_periods)
    : joints_(machine.joints.size()),
      corrections_(chain ? static_cast<std::size_t>(chain->size()) : 0),
      lag_(static_cast<std::size_t>(feedback_periods)),
      columns_(machine_column(kMachineColumns)),
      period_s_(machine.period_s) {
  for (std::size_t i = 0; i < joints_; ++i) add_joint(machine.joints[i], i, chain);
  add_machine();
}

const Signal* SignalTable::find(std::string_view name) const {
  const auto found = std::find_if(signals_.begin(), signals_.end(),
                                  [&](const Signal& signal) { return signal.name == name; });
  return found == signals_.end() ? nullptr : &*found;
}

void SignalTable::add(std::string name, std::string unit, std::string meaning, std::size_t column,
                      double scale) {
  signals_.push_back(
      {std::move(name), std::move(unit), std::move(meaning), static_cast<int>(column), -1, scale});
}

void SignalTable::add_joint(const Joint& joint, std::size_t index, const SetpointChain* chain) {
  const bool rotary = joint.kind == JointKind::kRotary;
  const double scale = rotary ? kDegPerRad : 1;
  const std::string unit = rotary ? "deg" : "mm", force = rotary ? "Nm" : "N";
  const auto put = [&](const char* name, const std::string& in, const char* meaning, JointColumn column,
                       double times) {
    add(joint.name + name, in, meaning, joint_column(index, column), times);
  };
  put(".plan", unit, "place by the plan, without corrections", kPlan, scale);
  put(".setpoint", unit, "place that the drive is told", kSetpoint, scale);
  put(".measured", unit, "place that the drive tells", kMeasured, scale);
  put(".following_error", unit, "setpoint that the measurement belongs to, less the measurement", kFollowing,
      scale);
  put(".velocity", unit + "/s", "of the setpoint", kVelocity, scale);
  put(".acceleration", unit + "/s^2", "of the setpoint", kAcceleration, scale);
  put(".measured_velocity", unit + "/s", "of the measurement", kMeasuredVelocity, scale);
  put(".force", force, "of the motor, as the drive tells it (0x6077)", kForce, 1);
  put(".current", "A", "of the motor, where the drive tells it", kCurrent, 1);
  put(".velocity_offset", unit + "/s", "told to the drive in advance (0x60B1)", kVelocityOffset, scale);
  put(".force_offset", force, "told to the drive in advance (0x60B2)", kForceOffset, 1);
  put(".statusword", "", "0x6041", kStatusWord, 1);
  put(".controlword", "", "0x6040", kControlWord, 1);
  for (std::size_t k = 0; k < corrections_; ++k)
    add(fmt::format("{}.{}", joint.name, chain->budget(static_cast<int>(k)).name), unit,
        "what this correction adds", correction_column(index, k), scale);
}

void SignalTable::add_bits(std::string_view stem, std::string_view what, MachineColumn low,
                           MachineColumn high) {
  for (int i = 0; i < kMaxIo; ++i)
    signals_.push_back({fmt::format("{}.{}", stem, i), "", fmt::format("digital {} {}", what, i),
                        static_cast<int>(machine_column(i < kHalf ? low : high)), i % kHalf});
}

void SignalTable::add_machine() {
  const auto put = [&](const char* name, const char* unit, const char* meaning, MachineColumn column) {
    add(name, unit, meaning, machine_column(column));
  };
  put("line", "", "source line that moves", kLine);
  put("rate", "", "rate of the motion: 1 as planned, 0 at rest", kRate);
  put("speed", "mm/s", "of the tip along its path", kSpeed);
  put("motion", "", "0 rest, 1 moving, 2 held, 3 paused, 4 jogging, 5 homing", kMotion);
  put("drives", "", "0 off, 1 starting, 2 enabled, 3 homing, 4 quick stop, 5 fault, 6 lost", kDrives);
  put("fault", "", "number in the fault table; 0: none", kFault);
  put("spindle", "rpm", "speed that the spindle is told", kSpindle);
  put("spindle_turns", "", "of the spindle's encoder", kSpindleTurns);
  put("probe", "", "1: contact", kProbe);
  put("coolant", "", "1 mist, 2 flood", kCoolant);
  put("wake", "us", "how late the tick began", kWake);
  put("tick", "us", "how long the tick before this one took", kTick);
  add_bits("input", "input", kInputsLow, kInputsHigh);
  add_bits("output", "output", kOutputsLow, kOutputsHigh);
}

// Behind a gap the machine counts as at rest where it is.
void SignalSampler::begin(const CycleReport& report) {
  if (report.period == next_period_ && next_period_ != 0) return;
  setpoints_.fill(report.q_setpoint);
  measured_ = report.q_measured;
}

void SignalSampler::sample(const CycleReport& report, double* row) {
  TRN_CHECK(table_.feedback_periods() < kPastMax);
  begin(report);
  std::rotate(setpoints_.begin(), setpoints_.end() - 1, setpoints_.end());
  setpoints_[0] = report.q_setpoint;
  for (std::size_t i = 0; i < table_.joints(); ++i) sample_joint(report, i, row);
  sample_machine(report, row);
  measured_ = report.q_measured;
  next_period_ = report.period + 1;
}

void SignalSampler::sample_joint(const CycleReport& report, std::size_t joint, double* row) const {
  using T = SignalTable;
  const auto i = static_cast<Eigen::Index>(joint);
  const double dt = table_.period_s();
  const double d0 = setpoints_[0][i] - setpoints_[1][i], d1 = setpoints_[1][i] - setpoints_[2][i];
  double* const out = row + table_.joint_column(joint, T::kPlan);
  out[T::kPlan] = report.q_plan[i];
  out[T::kSetpoint] = report.q_setpoint[i];
  out[T::kMeasured] = report.q_measured[i];
  out[T::kFollowing] = setpoints_[table_.feedback_periods()][i] - report.q_measured[i];
  out[T::kVelocity] = d0 / dt;
  out[T::kAcceleration] = (d0 - d1) / (dt * dt);
  out[T::kMeasuredVelocity] = (report.q_measured[i] - measured_[i]) / dt;
  out[T::kForce] = at(report.force, i);
  out[T::kCurrent] = at(report.current_A, i);
  out[T::kVelocityOffset] = at(report.velocity_offset, i);
  out[T::kForceOffset] = at(report.force_offset, i);
  out[T::kStatusWord] = report.words[joint].status;
  out[T::kControlWord] = report.words[joint].control;
  for (std::size_t k = 0; k < table_.corrections(); ++k)
    row[table_.correction_column(joint, k)] = at(report.corrections[k].offset, i);
}

void SignalSampler::sample_machine(const CycleReport& report, double* row) const {
  using T = SignalTable;
  double* const out = row + table_.machine_column(T::kLine);
  out[T::kLine] = report.line;
  out[T::kRate] = report.override_now;
  out[T::kSpeed] = report.speed_mm_s;
  out[T::kMotion] = static_cast<double>(report.motion);
  out[T::kDrives] = static_cast<double>(report.drives);
  out[T::kFault] = static_cast<double>(report.fault);
  out[T::kSpindle] = report.spindle_rpm;
  out[T::kSpindleTurns] = report.spindle_turns;
  out[T::kProbe] = report.probe ? 1 : 0;
  out[T::kCoolant] = report.coolant;
  out[T::kInputsLow] = low_half(report.inputs);
  out[T::kInputsHigh] = high_half(report.inputs);
  out[T::kOutputsLow] = low_half(report.outputs);
  out[T::kOutputsHigh] = high_half(report.outputs);
  out[T::kWake] = report.wake_us;
  out[T::kTick] = report.tick_us;
}

}  // namespace trn
