#include "kernel/probe_move.h"

#include "core/check.h"
#include "kernel/tick_io.h"

namespace trn {

ProbeMove::ProbeMove(Drives& drives, std::size_t joints)
    : drives_(dynamic_cast<TouchDrives*>(&drives)), all_joints_((1u << joints) - 1) {
  if (drives_ && drives_->touch_periods() == 0) drives_ = nullptr;
  q_contact_.setZero(static_cast<Eigen::Index>(joints));
}

ProbeMove::Wait ProbeMove::arm(ProbeMode mode) TRN_RT {
  if (!drives_) return Wait::kOver;
  if (waited_ == 0) drives_->arm_touch(seeks_contact(mode));
  if (++waited_ <= drives_->touch_periods()) return Wait::kGoesOn;
  waited_ = 0;
  return drives_->touch().armed ? Wait::kOver : Wait::kFailed;
}

void ProbeMove::touch(const JointVec& q_measured) TRN_RT {
  TRN_CHECK(q_measured.size() == q_contact_.size());
  if (!touched_) q_contact_ = q_measured;
  touched_ = true;
}

ProbeMove::Wait ProbeMove::take_latched() TRN_RT {
  TRN_CHECK(touched_);
  if (!drives_ || taken_) return Wait::kOver;
  if (++waited_ <= drives_->touch_periods()) return Wait::kGoesOn;
  waited_ = 0;
  taken_ = true;  // the rest of the move may take further periods to be skipped
  const bool all = (drives_->touch().latched_mask & all_joints_) == all_joints_;
  if (all) q_contact_ = drives_->touch().q;
  drives_->disarm_touch();
  return all ? Wait::kOver : Wait::kFailed;
}

void ProbeMove::reset() TRN_RT {
  touched_ = taken_ = false;
  waited_ = 0;
}

}  // namespace trn
