#include "hal/can/gantry_link.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "core/check.h"
#include "core/fault.h"
#include "hal/can/cia402_axis.h"
#include "hal/drive_severity.h"

namespace trn {

GantryLink::GantryLink(const Gantry::Config& config, std::vector<NodeLink*> motors)
    : gantry_(config), motors_(std::move(motors)) {
  TRN_CHECK(static_cast<int>(motors_.size()) == config.motors);
}

Gantry::Motors GantryLink::motors_now() const TRN_RT {
  Gantry::Motors out;
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    const Cia402Axis& axis = motors_[i]->axis();
    const DriveState state = motors_[i]->state();
    out[i] = {axis.measured(), state == DriveState::kEnabled, state == DriveState::kHoming, axis.homed()};
  }
  return out;
}

bool GantryLink::one_has_failed() const TRN_RT {
  return std::any_of(motors_.begin(), motors_.end(), [](const NodeLink* motor) TRN_RT {
    return severity(motor->state()) >= severity(DriveState::kQuickStop);
  });
}

void GantryLink::step(const Setpoints& setpoints, bool follow) TRN_RT {
  const int joint = gantry_.config().joint;
  TRN_CHECK(joint >= 0 && joint < setpoints.q.size());
  gantry_.advance();
  // Every motor goes as fast as the joint, and takes its share of the force.
  const double velocity = joint < setpoints.velocity_offset.size() ? setpoints.velocity_offset[joint] : 0;
  const double force = joint < setpoints.force_offset.size() ? setpoints.force_offset[joint] : 0;
  for (std::size_t i = 0; i < motors_.size(); ++i) {
    const Gantry::Demand demand =
        gantry_.demand(static_cast<int>(i), setpoints.q[joint], setpoints.qd[joint], follow);
    motors_[i]->set_offsets(velocity, force / static_cast<double>(motors_.size()));
    motors_[i]->step(demand.q, demand.qd, demand.follow);
  }
  const bool together = gantry_.observe(motors_now());
  if (!together && parted_by_.load(std::memory_order_relaxed) == 0) {
    parted_by_.store(gantry_.apart(), std::memory_order_relaxed);
    for (NodeLink* motor : motors_) motor->axis().fail(Fault::kGantryParted);
  }
  // A motor that goes on alone twists the gantry: the others stop with this period's frames, not with the
  // tick's reaction in the next one.
  if (!together || one_has_failed())
    for (NodeLink* motor : motors_) motor->halt();
}

// Motors that have parted have been stopped, and are paired anew when they have power again. Those that obey
// go on: the reset may be for another fault, while the plan still stops on its path.
void GantryLink::reset() TRN_RT { parted_by_.store(0, std::memory_order_relaxed); }

void GantryLink::report(Feedback& feedback) const TRN_RT {
  const int joint = gantry_.config().joint;
  feedback.q[joint] = gantry_.measured();
  feedback.state = worst(feedback.state, gantry_.state());
  const bool homed = std::all_of(motors_.begin(), motors_.end(),
                                 [](const NodeLink* motor) TRN_RT { return motor->axis().homed(); });
  if (!homed) feedback.homed_mask &= ~(1u << joint);
  if (joint >= feedback.force.size()) return;
  double force = 0;
  for (const NodeLink* motor : motors_)
    if (double part = 0; motor->force(part)) force += part;
  feedback.force[joint] = force;
}

void GantryLink::report_touch(TouchProbe& touch) const TRN_RT {
  const int joint = gantry_.config().joint;
  double mean = 0;
  for (const NodeLink* motor : motors_) {
    if (!motor->touch().latched()) touch.latched_mask &= ~(1u << joint);
    mean += motor->axis().position_of(motor->touch().counts()) / gantry_.config().motors;
  }
  if (touch.latched_mask >> joint & 1u) touch.q[joint] = mean;
}

std::string GantryLink::explain() const {
  const double apart = parted_by_.load(std::memory_order_relaxed);
  if (apart == 0) return "";
  const Gantry::Config& config = gantry_.config();
  std::string names;
  for (const NodeLink* motor : motors_) names += (names.empty() ? "" : ", ") + motor->config().name;
  return fmt::format("joint {}: {}; they were {:.3f} {} apart, {:g} are allowed, {:g} while they home ({})",
                     config.name, fault_info(Fault::kGantryParted).meaning, apart / config.unit,
                     config.unit_name, config.apart_max / config.unit, config.apart_homing_max / config.unit,
                     names);
}

}  // namespace trn
