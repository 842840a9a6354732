#pragma once

#include "core/frames.h"
#include "core/realtime.h"

// Tool-centre-point control (RTCP): the program gives the tip, the machine needs the spindle nose. The tool
// offset runs from tip T to gauge point S in the spindle's frame, (0, 0, L) for a tool of length L (mm).
// Source: docs/sources.md S2.2, P = tip + L u, written for any tool offset.
namespace trn {

/// Pose X_BS of the spindle that puts the tip at p_BT with orientation R_BT.
Pose spindle_from_tip(const Vec3& p_BT, const Mat3& R_BT, const Vec3& tool_offset) TRN_RT;

/// Tip p_BT of a spindle at X_BS.
Vec3 tip_from_spindle(const Pose& X_BS, const Vec3& tool_offset) TRN_RT;

}  // namespace trn
