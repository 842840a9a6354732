#include "app/lab/commission/emulated_commission.h"

#include <fmt/format.h>

#include <cmath>
#include <stdexcept>
#include <utility>

#include "app/session/make_cycle.h"
#include "core/units.h"
#include "hal/can/can_config.h"
#include "kernel/cycle.h"
#include "kinematics/factory.h"

namespace trn {

bool CommissionMachine::until(const std::function<bool(const CycleReport&)>& done, double time_s) {
  constexpr double kLook_s = 0.02;
  for (double passed_s = 0; passed_s < time_s; passed_s += kLook_s) {
    if (done(report())) return true;
    wait(kLook_s);
  }
  return done(report());
}

EmulatedCommission::EmulatedCommission(const std::string& config, const std::string& truth)
    : CommissionMachine(assemble(config, Field::kEmulated)), truth_(read_machine(load_config(truth))) {
  if (drives_type(assembly_.machine) != "canopen" || drives_type(truth_) != "canopen")
    throw std::runtime_error("the drives of this machine are on no CAN bus: nothing to rehearse");
  auto drives = std::make_unique<EmulatedCanDrives>(assembly_.machine, assembly_.machine.root.table("drives"),
                                                    truth_, truth_.root.table("drives"));
  field_ = drives.get();
  assembly_.drives = std::move(drives);
  cycle_.reset(new Cycle(make_cycle(assembly_, queue_, ProgramStops::kPass)));
  cycle_->tick();
}

void EmulatedCommission::wait(double time_s) {
  const int periods = static_cast<int>(std::ceil(time_s / assembly_.machine.period_s));
  for (int i = 0; i < periods; ++i) cycle_->tick();
}

JointVec EmulatedCommission::true_places() {
  JointVec q = JointVec::Zero(static_cast<Eigen::Index>(truth_.joints.size()));
  const CanDrivesConfig& config = field().config();
  for (std::size_t b = 0; b < config.buses.size(); ++b)
    for (std::size_t i = 0; i < config.buses[b].nodes.size(); ++i)
      q[config.buses[b].nodes[i].link.joint] = field().node(b, i).drive().joint().true_place();
  return q;
}

RehearsedOperator::RehearsedOperator(std::unique_ptr<CommissionMachine>& machine,
                                     std::function<void(const std::string&)> say)
    : machine_(machine), say_(std::move(say)) {}

bool RehearsedOperator::agrees(const std::string& text) {
  say_(text);
  if (machine_) before_ = emulated().true_places();
  return true;
}

double RehearsedOperator::measured(const std::string& text, int joint) {
  const bool rotary = emulated().truth().joints[static_cast<std::size_t>(joint)].kind == JointKind::kRotary;
  const double way = std::abs(emulated().true_places()[joint] - before_[joint]) * (rotary ? kDegPerRad : 1);
  // A good ruler shows a hundredth.
  const double seen = std::round(100 * way) / 100;
  say_(fmt::format("{}\n  > {:g}", text, seen));
  return seen;
}

bool RehearsedOperator::went_positive(const std::string& text, int word) {
  const auto kinematics = make_kinematics(emulated().truth());
  Words from, to;
  kinematics->words_from_joints(before_, from);
  kinematics->words_from_joints(emulated().true_places(), to);
  const bool positive = to[word] > from[word];
  say_(fmt::format("{}\n  > {}", text, positive ? "yes" : "no"));
  return positive;
}

}  // namespace trn
