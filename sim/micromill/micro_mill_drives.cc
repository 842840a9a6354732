#include "sim/micromill/micro_mill_drives.h"

#include <cmath>

#include "core/axes.h"
#include "sim/micromill/linear_motor_axis.h"

namespace trn {

MicroMillDrives::MicroMillDrives(const Config& config) : config_(config), plant_(config.plant) {
  plant_.clamp(config.part);
  set_enabled(false);
}

void MicroMillDrives::set_enabled(bool enabled) TRN_RT {
  if (!enabled) enable_asked_.store(false);  // by a bring-up that began before
  for (int i = 0; i < 2; ++i) plant_.axis(i).set_enabled(enabled);
  if (state_ != DriveState::kFault) state_ = enabled ? DriveState::kEnabled : DriveState::kOff;
}

void MicroMillDrives::obey_requests() TRN_RT {
  if (disable_asked_.exchange(false)) set_enabled(false);
  if (reset_asked_.exchange(false)) {
    fault_ = Fault::kOk;
    fault_joint_ = -1;
    if (state_ == DriveState::kFault) state_ = DriveState::kOff;
  }
  if (enable_asked_.exchange(false) && state_ == DriveState::kOff) set_enabled(true);
}

void MicroMillDrives::exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT {
  obey_requests();
  // Without power the target stands still where it was; the axes are free.
  Eigen::Vector3d target(plant_.axis(0).target_mm(), plant_.axis(1).target_mm(), plant_.z_mm());
  if (state_ == DriveState::kEnabled) target = setpoints.q.head<3>();
  plant_.step(target);
  if (state_ == DriveState::kEnabled) watch(setpoints);
  report(feedback);
}

void MicroMillDrives::watch(const Setpoints& setpoints) TRN_RT {
  for (int i = 0; i < 2; ++i) {
    if (std::abs(plant_.axis(i).x_mm() - setpoints.q[i]) <= config_.following_error_max_mm) continue;
    set_enabled(false);
    state_ = DriveState::kFault;
    fault_ = Fault::kFollowingError;
    fault_joint_ = i;
    return;
  }
}

void MicroMillDrives::report(Feedback& feedback) TRN_RT {
  feedback.q.resize(3);
  feedback.current_A.setZero(3);
  for (int i = 0; i < 2; ++i) {
    feedback.q[i] = plant_.axis(i).encoder_mm();
    feedback.current_A[i] = plant_.axis(i).current_A();
  }
  feedback.q[2] = plant_.z_mm();
  feedback.state = state_;
  feedback.fault = fault_;
  feedback.fault_joint = fault_joint_;
  feedback.homed_mask = 7;
  feedback.limit_switch_mask = 0;
}

MicroMillDrives::Config read_micro_mill_drives(const Machine& machine, const ConfigTable& drives) {
  const Joints& joints = machine.joints;
  if (joints.size() != 3 || joints[0].name != "X" || joints[1].name != "Y" || joints[2].name != "Z")
    throw drives.error("type",
                       "drives of type \"micro_mill\" need exactly the joints X, Y and Z, in this order");
  MicroMillDrives::Config config;
  const auto seed = static_cast<std::uint64_t>(drives.integer("seed", 0, Range{0, 1e9}));
  config.plant = micro_mill_plant(seed, machine.period_s);
  const double error = drives.number("mass_error", 0, Range{-0.2, 0.2});
  // The real mass only. The drive and the estimator go on working with the nominal one.
  for (LinearMotorAxis::Config& axis : config.plant.axes) axis.mass_kg *= 1 + error;
  const std::string part = drives.choice("part", {"none", "round", "square"}, "none");
  if (part == "round") config.part.emplace(PartSurface::Config{PartSurface::Shape::kRound});
  if (part == "square") config.part.emplace(PartSurface::Config{PartSurface::Shape::kSquare});
  config.following_error_max_mm =
      drives.number("following_error_mm", config.following_error_max_mm, kPositive);
  return config;
}

}  // namespace trn
