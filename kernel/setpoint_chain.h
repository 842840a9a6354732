#pragma once

#include <memory>
#include <string>
#include <vector>

#include "compensation/offset_filter.h"
#include "compensation/sensor_board.h"
#include "core/axes.h"
#include "core/machine.h"
#include "core/ports.h"

namespace trn {

class DeflectionCorrection;

/// Bounds of one correction of the chain.
struct SetpointBudget {
  std::string name;       ///< of its section, [corrections.NAME]
  bool enabled = true;    ///< at start; may be switched at any time
  double limit_mm = 0;    ///< its greatest offset on a linear joint
  double limit_rad = 0;   ///< on a rotary joint
  double reserve = 0.01;  ///< share of the joints' velocity, acceleration and jerk that it may use
  int bit = 0;            ///< that a program's switch calls it by
};

/// The corrections behind the plan, in their one order. Each is bounded by its own limit and moves the joints
/// within its own reserve: the planner plans for `plan_joints`, so that plan and corrections together stay
/// inside the limits of the machine. Switching fades in and out within the reserve.
class SetpointChain {
 public:
  static constexpr int kMax = kMaxSetpointCorrections;
  /// `board`: the readings that corrections go by; null: none. It must outlive the chain.
  SetpointChain(const Joints& joints, double period_s, SensorBoard* board = nullptr)
      : joints_(joints), period_s_(period_s), board_(board) {}

  /// At most kMax, in the order in which they act.
  void append(const SetpointBudget& budget, std::unique_ptr<SetpointCorrection> correction);
  /// The same for the one that estimates the tool's load, which `deflection` then tells.
  void append_deflection(const SetpointBudget& budget, std::unique_ptr<DeflectionCorrection> correction);
  /// Null: the machine does not estimate the tool's load.
  const DeflectionCorrection* deflection() const TRN_RT { return deflection_; }
  /// How far it shifts the first two joints, mm.
  Eigen::Vector2d deflection_shift_mm() const TRN_RT;
  /// Lets the chain take up jumps of the plan's joints (`take_up`), with this share of the limits.
  void take_up_jumps(double reserve);
  /// At rest the plan's joints jump by -jump, because the joint map reads the same place in another way: the
  /// setpoints stay, and the difference fades within the reserve. False: it is too large.
  bool take_up(const JointVec& jump) TRN_RT;
  bool takes_up_jumps() const TRN_RT { return !jumps_.empty(); }
  int size() const TRN_RT { return static_cast<int>(links_.size()); }
  const SetpointBudget& budget(int i) const { return links_[static_cast<std::size_t>(i)].budget; }

  /// What the planner may use: ranges less the limits, rates less the reserves of all corrections.
  Joints plan_joints() const;

  /// One period: offsets from the plan's joints.
  void step(const CorrectionInput& input) TRN_RT;
  /// The reading that was heard in it, if any.
  const SensorSample& heard() const TRN_RT { return heard_; }
  /// Switches for good, and forgets what the program has asked for.
  void enable(int i, bool on) TRN_RT;
  /// A program's switch of all with one of `bits`, until `forget_program`. The time until that has come in or
  /// gone, but for 4e-5 of the limit, s.
  double switch_by_program(int bits, bool on) TRN_RT;
  void forget_program() TRN_RT;
  bool enabled(int i) const TRN_RT { return links_[static_cast<std::size_t>(i)].on(); }
  /// What correction i adds in this period, mm or rad; zero before the first step.
  const JointVec& offset(int i) const TRN_RT { return links_[static_cast<std::size_t>(i)].offset; }
  /// The sum over all corrections.
  const JointVec& offset() const TRN_RT { return sum_; }
  const char* warning(int i) const TRN_RT {
    return links_[static_cast<std::size_t>(i)].correction->warning();
  }

 private:
  struct Link {
    SetpointBudget budget;
    std::unique_ptr<SetpointCorrection> correction;
    std::vector<OffsetFilter> filters;  ///< by joint; of the offset, or of the switch
    std::vector<double> limits;         ///< by joint; 0: does not act there
    bool enabled = true, switched = false, switched_on = false;
    JointVec wanted, offset;
    bool on() const TRN_RT { return switched ? switched_on : enabled; }
  };
  void step(Link& link, const CorrectionInput& input) TRN_RT;

  Joints joints_;
  double period_s_;
  SensorBoard* board_;
  SensorSample heard_;
  std::vector<Link> links_;
  const DeflectionCorrection* deflection_ = nullptr;
  int deflection_link_ = 0;
  std::vector<OffsetFilter> jumps_;  ///< by joint; none: jumps are not expected
  double jump_reserve_ = 0;
  JointVec sum_;
};

}  // namespace trn
