#include "app/session/assembly.h"

#include <fmt/format.h>

#include <algorithm>

#include "app/session/drawing_config.h"
#include "app/session/inline_rate_plans.h"
#include "app/session/safety_config.h"
#include "compensation/sensor_board.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/units.h"
#include "hal/modbus/field_devices.h"
#include "hal/modbus/modbus_io.h"
#include "kernel/rate_plan.h"
#include "kinematics/factory.h"
#include "sim/modbus/emulated_cabinet.h"

namespace trn {

PlannerConfig read_planner(const ConfigTable& root) {
  PlannerConfig config;
  const std::optional<ConfigTable> table = root.table_if("planner");
  if (!table) return config;
  const Range share{0.5, 0.995};  // the next bit is the tick's own, for override and hold
  config.geometry.compress = table->boolean("compress", config.geometry.compress);
  config.speed.acceleration_share =
      table->number("acceleration_share", config.speed.acceleration_share, share);
  config.speed.jerk_share = table->number("jerk_share", config.speed.jerk_share, share);
  config.tolerance_mm_max = table->number("tolerance_mm_max", config.tolerance_mm_max, kPositive);
  config.buffer_s = table->number("buffer_s", config.buffer_s, Range{0.5, 10});
  config.memory_mb = table->integer("memory_mb", config.memory_mb, Range{64, 65536});
  return config;
}

namespace {

void add_corrections(Assembly& a) {
  a.corrections = read_corrections(a.machine);
  a.plan_joints = a.corrections.setpoint->plan_joints();
  a.map =
      std::make_unique<MachineJointMap>(*a.kinematics, a.corrections.pose.get(), a.corrections.joint.get());
  const auto screws = read_simulated_screws(a.machine, *a.corrections.sensors);
  if (!screws.empty())
    a.screws = std::make_unique<SimulatedScrews>(screws, a.machine.period_s, *a.corrections.sensors);
}

FieldDevices::Listener feed(SensorBoard& board) {
  return [&board](const std::string& name, double value) {
    const auto found = std::find(board.names().begin(), board.names().end(), name);
    if (found != board.names().end()) board.publish(static_cast<int>(found - board.names().begin()), value);
  };
}

// Real devices answer in the daemon; in `run` simulated ones stand in their place.
void add_io(Assembly& a, Field field) {
  const ModbusIoConfig modbus = read_modbus_io(a.machine.root);
  read_emulated_values(a.machine.root, modbus.devices);  // knows the keys of the emulation
  if (const auto section = a.machine.root.table_if("io")) {
    a.spindle_timeout_s = section->number("spindle_timeout_s", a.spindle_timeout_s, kPositive);
    a.io = make_io(a.machine, *section, *a.kinematics);
  }
  if (field == Field::kReal && !modbus.devices.devices.empty())
    a.io = std::make_unique<ModbusIo>(modbus, feed(*a.corrections.sensors));
}

}  // namespace

namespace {

void add_rate_plans(Assembly& assembly) {
  assembly.rate_plans = std::make_unique<InlineRatePlans>(assembly.plan_joints, assembly.machine.period_s);
}

/// The joint that moves alone when the word does, and its way for 1 of the word; -1: there is none.
std::pair<int, double> joint_of_word(const Kinematics& kinematics, int word) {
  JointVec q;
  Words words = Words::Zero();
  words[word] = 1;
  if (!kinematics.words_are_joints() || !(kinematics.word_mask() >> word & 1U)) return {-1, 0};
  if (kinematics.joints_from_words(words, q) != KinStatus::kOk) return {-1, 0};
  Eigen::Index joint = -1;
  q.cwiseAbs().maxCoeff(&joint);
  return {static_cast<int>(joint), q[joint]};
}

/// The spindle's limits are those of its joint.
void check_spindle_axis(Assembly& a) {
  SpindleAxisConfig& axis = a.program.spindle_axis;
  if (axis.axis < 0) return;
  const ConfigTable table = a.machine.root.table("spindle_axis");
  const auto [joint, sense] = joint_of_word(*a.kinematics, axis.axis);
  if (joint < 0 || !a.machine.joints[static_cast<std::size_t>(joint)].endless)
    throw table.error(
        "axis", fmt::format("a spindle turns without an end: the joint of word {} needs 'endless = true'",
                            kWordLetters[axis.axis]));
  axis.word_sense = sense;
  axis.rpm_max = SpindleAxis::kSpeedShare * a.plan_joints[static_cast<std::size_t>(joint)].limit.velocity *
                 60 / (2 * kPi);
}

void add_spindle_axis(Assembly& a) {
  const SpindleAxisConfig& axis = a.program.spindle_axis;
  if (axis.axis < 0) return;
  const int joint = joint_of_word(*a.kinematics, axis.axis).first;
  auto made = std::make_unique<SpindleAxis>(
      SpindleAxis::Config{joint, a.plan_joints[static_cast<std::size_t>(joint)], axis.sense,
                          a.machine.period_s, a.drives->feedback_periods()},
      std::move(a.io));
  a.spindle_axis = made.get();
  a.io = std::move(made);
}

/// Nothing else of the config tells whether the machine has the axis that turns the knife.
void check_knife(const Assembly& a) {
  const int axis = a.program.tangential.axis;
  if (axis < 0 || a.kinematics->word_mask() >> axis & 1U) return;
  throw a.machine.root.table("tangential")
      .error("axis", fmt::format("no joint obeys the word {} that shall turn the knife", kWordLetters[axis]));
}

/// The same for an axis whose words are angles on a circle.
void check_wrapped(const Assembly& a) {
  std::string axes;
  for (int word = kA; word <= kC; ++word)
    if (a.kinematics->word_mask() >> word & 1U) axes += fmt::format(" {}", kWordLetters[word]);
  for (int word = kA; word <= kC; ++word)
    if ((a.program.wrapped_mask & ~a.kinematics->word_mask()) >> word & 1U)
      throw a.machine.root.table("program").error(
          "wrapped", fmt::format("'{}' is no axis of this machine; its rotary axes:{}", kWordLetters[word],
                                 axes.empty() ? " none" : axes));
}

}  // namespace

Assembly assemble(const std::string& config_path, Field field) {
  return assemble(load_config(config_path), field);
}

Assembly assemble_planning(const ConfigTable& config) {
  Assembly a{read_machine(config),
             nullptr,
             {},
             {},
             nullptr,
             nullptr,
             {},
             {},
             {},
             {},
             {},
             {},
             nullptr,
             nullptr,
             nullptr};
  const ConfigTable& root = a.machine.root;
  a.kinematics = make_kinematics(a.machine);
  add_corrections(a);
  a.program = read_program_config(root);
  a.program.switches = read_switches(root, a.program);
  check_knife(a);
  check_wrapped(a);
  check_spindle_axis(a);
  a.planner = read_planner(root);
  // The queue must always hold several holds' worth of motion, or the tick would slow down for fear of its
  // end.
  a.planner.buffer_s = std::max(a.planner.buffer_s, 4 * plan_stop_s(a.plan_joints));
  return a;
}

Assembly assemble(const ConfigTable& config, Field field) {
  Assembly a = assemble_planning(config);
  const ConfigTable& root = a.machine.root;
  add_rate_plans(a);
  a.realtime = read_realtime(root);
  a.lcm = read_lcm(root, a.machine.name);
  a.access = read_access(root);
  a.gateway = read_gateway(root);
  a.scope = read_scope(root);
  a.feed_forward = read_feed_forward(a.machine);
  a.drives = make_drives(a.machine, field);
  add_io(a, field);
  add_spindle_axis(a);
  a.safety = read_safety_inputs(a.machine);
  a.signals = read_signals(a.machine);
  read_drawings(a.machine);  // the panel's; their keys are known
  root.finish();
  return a;
}

JointVec standing_joints(const Assembly& assembly) {
  Setpoints setpoints;
  Feedback feedback;
  setpoints.q.setZero(assembly.kinematics->joint_count());
  setpoints.qd = feedback.q = setpoints.q;
  assembly.drives->exchange(setpoints, feedback);
  return feedback.q;
}

void set_period(Assembly& assembly, double period_s) {
  assembly.machine.period_s = period_s;
  assembly.drives = make_drives(assembly.machine);
  assembly.io.reset();
  add_io(assembly, Field::kEmulated);
  add_spindle_axis(assembly);
  add_corrections(assembly);
  add_rate_plans(assembly);
}

}  // namespace trn
