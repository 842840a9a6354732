#include "sim/simulated_drives.h"

#include <limits>

#include "core/check.h"
#include "core/fault.h"
#include "hal/drive_severity.h"

namespace trn {

namespace {

void apply(SimulatedDrives::ScriptedEvent::Kind kind, SimulatedJoint& joint) TRN_RT {
  using Kind = SimulatedDrives::ScriptedEvent::Kind;
  switch (kind) {
    case Kind::kFault:
      return joint.fail(Fault::kDriveFault);
    case Kind::kLost:
      return joint.set_lost(true);
    case Kind::kFound:
      return joint.set_lost(false);
    case Kind::kStuck:
      return joint.set_stuck(true);
    case Kind::kFree:
      return joint.set_stuck(false);
  }
}

}  // namespace

SimulatedDrives::SimulatedDrives(const Config& config) : script_(config.script) {
  for (const SimulatedJoint::Config& joint : config.joints) joints_.emplace_back(joint);
}

void SimulatedDrives::exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT {
  TRN_CHECK(static_cast<std::size_t>(setpoints.q.size()) == joints_.size());
  obey_requests();
  run_script();
  const bool offsets = setpoints.velocity_offset.size() == setpoints.q.size() &&
                       setpoints.force_offset.size() == setpoints.q.size();
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    SimulatedJoint::Reference reference;
    if (offsets) reference = {reference.loop, setpoints.velocity_offset[k], setpoints.force_offset[k]};
    joints_[i].step(setpoints.q[k], reference);
  }
  report(feedback);
  ++period_;
}

void SimulatedDrives::request_home(unsigned joint_mask) TRN_RT {
  for (std::size_t i = 0; i < joints_.size(); ++i)
    if (joint_mask >> i & 1u) joints_[i].home();
}

void SimulatedDrives::quick_stop() TRN_RT {
  enable_asked_.store(false);  // by a bring-up that began before
  for (SimulatedJoint& joint : joints_) joint.quick_stop();
}

void SimulatedDrives::obey_requests() TRN_RT {
  // Switching off acts at once, also while a joint brakes: power that is gone is gone.
  if (disable_asked_.exchange(false)) {
    enable_asked_.store(false);  // by a bring-up that has just ended
    for (SimulatedJoint& joint : joints_) joint.disable();
  }
  for (const SimulatedJoint& joint : joints_)
    if (joint.braking()) return;  // the other requests wait until it stands
  if (reset_asked_.exchange(false))
    for (SimulatedJoint& joint : joints_) joint.reset();
  if (enable_asked_.exchange(false))
    for (SimulatedJoint& joint : joints_) joint.enable();
}

void SimulatedDrives::run_script() TRN_RT {
  for (const ScriptedEvent& event : script_)
    if (event.period == period_) apply(event.kind, joint(event.joint));
}

void SimulatedDrives::report(Feedback& feedback) const TRN_RT {
  feedback.q.resize(static_cast<Eigen::Index>(joints_.size()));
  feedback.state = DriveState::kEnabled;
  feedback.fault = Fault::kOk;
  feedback.fault_joint = -1;
  feedback.homed_mask = feedback.limit_switch_mask = 0;
  for (std::size_t i = 0; i < joints_.size(); ++i) {
    const SimulatedJoint& joint = joints_[i];
    const int index = static_cast<int>(i);
    feedback.q[index] = joint.measured();
    if (joint.has_mechanism()) {
      if (feedback.force.size() == 0)
        feedback.force.setConstant(feedback.q.size(), std::numeric_limits<double>::quiet_NaN());
      feedback.force[index] = joint.force();
    }
    if (joint.homed()) feedback.homed_mask |= 1u << i;
    if (joint.on_limit_switch()) feedback.limit_switch_mask |= 1u << i;
    // The worst joint speaks for all: the machine is enabled only if every drive is.
    if (severity(joint.state()) <= severity(feedback.state)) continue;
    feedback.state = joint.state();
    feedback.fault = joint.fault();
    feedback.fault_joint = joint.fault() == Fault::kOk ? -1 : index;
  }
}

}  // namespace trn
