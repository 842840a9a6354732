#pragma once

#include "core/axes.h"
#include "core/fault.h"
#include "core/machine.h"
#include "core/realtime.h"

namespace trn {

struct SetpointVerdict {
  Fault fault = Fault::kOk;
  int joint = -1;  ///< that is to blame
};

/// The last look before the drives: no joint further out of its range, no joint faster than its limit, and no
/// value that is not a number. `q_last`, `q`: setpoints of two periods in a row, mm or rad. The plan keeps
/// the limits by itself, so what is found here is a defect.
SetpointVerdict check_setpoints(const Joints& joints, double period_s, const JointVec& q_last,
                                const JointVec& q) TRN_RT;

}  // namespace trn
