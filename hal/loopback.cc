#include "hal/loopback.h"

#include "core/check.h"
#include "core/fault.h"

namespace trn {

void LoopbackDrives::exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT {
  TRN_CHECK(setpoints.q.size() == q_.size());
  TRN_CHECK(setpoints.q.allFinite());
  // Ideal drives: enabled, they stand where they are told, else they stay.
  if (state_ == DriveState::kEnabled) q_ = setpoints.q;
  feedback.q = q_;
  feedback.state = state_;
  feedback.fault = Fault::kOk;
  feedback.fault_joint = -1;
  feedback.homed_mask = (1u << q_.size()) - 1u;
  feedback.limit_switch_mask = 0;
}

}  // namespace trn
