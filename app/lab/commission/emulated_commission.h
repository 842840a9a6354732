#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/lab/commission/commission_machine.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/machine.h"
#include "kernel/rt_messages.h"
#include "sim/canopen/emulated_can.h"

namespace trn {

/// A rehearsal: the config commands emulated drives that are built and wired as another config, `truth`, has
/// it. Virtual time. std::runtime_error if the drives are on no CAN bus; ConfigError as `assemble`.
class EmulatedCommission final : public CommissionMachine {
 public:
  EmulatedCommission(const std::string& config, const std::string& truth, bool feed_forward);
  ~EmulatedCommission() override;
  void wait(double time_s) override;
  CycleReport report() override { return cycle_->last_report(); }
  double latest_us(double time_s) override;
  std::vector<ScannedBus> scan() override;
  bool rehearses() const override { return true; }
  const char* clock() const override {
    return "by this computer and its emulated drives; measure it again with the real ones";
  }

  /// By hand; `on` false: let go.
  void press(HandStep step, int joint, bool on);

  const Machine& truth() const { return truth_; }
  /// Where the axes really stand, mm or rad, in the truth's joints.
  JointVec true_places();

 private:
  EmulatedCanDrives& field() { return *field_; }

  class HeldIo;

  Machine truth_;
  EmulatedCanDrives* field_ = nullptr;
  HeldIo* held_ = nullptr;  ///< null: the machine has no [io]
};

/// Answers by what the axes really do.
class RehearsedOperator final : public CommissionOperator {
 public:
  /// `machine`: whoever is being commissioned now; it may be made anew.
  RehearsedOperator(std::unique_ptr<CommissionMachine>& machine, std::function<void(const std::string&)> say);
  bool agrees(const std::string& text) override;
  double measured(const std::string& text, int joint) override;
  bool went_positive(const std::string& text, int word) override;
  bool turned_clockwise(const std::string& text) override;
  bool does(const std::string& text, HandStep step, int joint) override;
  void lets_go(const std::string& text) override;
  void tell(const std::string& text) override { say_(text); }

 private:
  /// How the tool went since `before_`, seen from the work, in the axes of a program.
  struct ToolWay {
    Vec3 tip, turn;
  };
  /// nullopt where the truth knows no pose.
  std::optional<ToolWay> tool_way();
  /// Turn of the tool that a positive rotary word means by the config.
  Vec3 meant_turn(int word) const;
  EmulatedCommission& emulated() { return dynamic_cast<EmulatedCommission&>(*machine_); }

  std::unique_ptr<CommissionMachine>& machine_;
  std::function<void(const std::string&)> say_;
  JointVec before_;  ///< true places when it last agreed to a motion
  double turns_before_ = 0;
  HandStep holds_ = HandStep::kProbe;
  int holds_joint_ = -1;
};

}  // namespace trn
