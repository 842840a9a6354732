#pragma once

#include "core/ports.h"

namespace trn {

/// How much one joint's state says about the whole machine; the worst one is reported.
inline int severity(DriveState state) TRN_RT {
  switch (state) {
    case DriveState::kEnabled:
      return 0;
    case DriveState::kHoming:
      return 1;
    case DriveState::kStarting:
      return 2;
    case DriveState::kOff:
      return 3;
    case DriveState::kQuickStop:
      return 4;
    case DriveState::kFault:
      return 5;
    case DriveState::kLost:
      return 6;
  }
  return 6;
}
inline DriveState worst(DriveState a, DriveState b) TRN_RT { return severity(b) > severity(a) ? b : a; }

}  // namespace trn
