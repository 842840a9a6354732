#include "compensation/rtcp.h"

namespace trn {

Pose spindle_from_tip(const Vec3& p_BT, const Mat3& R_BT, const Vec3& tool_offset) TRN_RT {
  // The offset is given in the spindle's frame, so it turns with the tool: P = tip + L u for a straight one.
  return {R_BT, p_BT + R_BT * tool_offset};
}

Vec3 tip_from_spindle(const Pose& X_BS, const Vec3& tool_offset) TRN_RT {
  return X_BS.p - X_BS.R * tool_offset;
}

}  // namespace trn
