#pragma once

#include <memory>
#include <string>

#include "app/lab/commission/commission_machine.h"
#include "core/axes.h"
#include "core/machine.h"
#include "kernel/rt_messages.h"
#include "sim/canopen/emulated_can.h"

namespace trn {

/// A rehearsal: the config commands emulated drives that are built and wired as another config, `truth`, has
/// it. Virtual time. std::runtime_error if the drives are on no CAN bus; ConfigError as `assemble`.
class EmulatedCommission final : public CommissionMachine {
 public:
  EmulatedCommission(const std::string& config, const std::string& truth);
  void wait(double time_s) override;
  CycleReport report() override { return cycle_->last_report(); }

  const Machine& truth() const { return truth_; }
  /// Where the axes really stand, mm or rad, in the truth's joints.
  JointVec true_places();

 private:
  EmulatedCanDrives& field() { return *field_; }

  Machine truth_;
  EmulatedCanDrives* field_ = nullptr;
};

/// Answers by what the axes really do.
class RehearsedOperator final : public CommissionOperator {
 public:
  /// `machine`: whoever is being commissioned now; it may be made anew.
  RehearsedOperator(std::unique_ptr<CommissionMachine>& machine, std::function<void(const std::string&)> say);
  bool agrees(const std::string& text) override;
  double measured(const std::string& text, int joint) override;
  bool went_positive(const std::string& text, int word) override;
  void tell(const std::string& text) override { say_(text); }

 private:
  EmulatedCommission& emulated() { return dynamic_cast<EmulatedCommission&>(*machine_); }

  std::unique_ptr<CommissionMachine>& machine_;
  std::function<void(const std::string&)> say_;
  JointVec before_;  ///< true places when it last agreed to a motion
};

}  // namespace trn
