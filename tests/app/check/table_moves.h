#pragma once

#include "core/axes.h"
#include "core/frames.h"
#include "core/ports.h"
#include "core/units.h"
#include "interp/move.h"

// Lines and arcs on a tilting table, for the tests of what measures deviations.
namespace trn {

// An A/C tilting table as far as the meter needs it: u in the table frame.
class TableKinematics : public Kinematics {
 public:
  int joint_count() const TRN_RT override { return 5; }
  unsigned word_mask() const TRN_RT override { return 0b101111; }
  Pose home_X_BM() const TRN_RT override { return {}; }
  Mat3 orientation(const Vec3& abc) const TRN_RT override { return rot_z(-abc[2]) * rot_x(-abc[0]); }
  KinStatus words_for_axis(const Vec3&, const Vec3&, Vec3&) const TRN_RT override {
    return KinStatus::kUnreachable;
  }
  KinStatus forward(const JointVec&, Pose&) const TRN_RT override { return KinStatus::kUnreachable; }
  KinStatus inverse(const Pose&, const JointVec&, JointVec&) const TRN_RT override {
    return KinStatus::kUnreachable;
  }
  KinStatus joints_from_words(const Words&, JointVec&) const TRN_RT override {
    return KinStatus::kUnreachable;
  }
  KinStatus words_from_joints(const JointVec&, Words&) const TRN_RT override {
    return KinStatus::kUnreachable;
  }
};

inline const Vec3 kUp(0, 0, 1);

inline Words words(const Vec3& p, double a_deg = 0, double c_deg = 0) {
  Words y = Words::Zero();
  y.head<3>() = p;
  y[kA] = rad_from_deg(a_deg);
  y[kC] = rad_from_deg(c_deg);
  return y;
}

inline ProgramMove line(const Words& from, const Words& to, double tolerance_mm = 0.01,
                        double tolerance_deg = 0.05) {
  ProgramMove move;
  move.kind = ProgramMove::Kind::kFeed;
  move.from = from;
  move.to = to;
  move.context.rtcp = true;
  move.mode = tolerance_mm > 0 ? PathMode::kContinuous : PathMode::kExactPath;
  move.tolerance_mm = tolerance_mm;
  move.tolerance_rad = rad_from_deg(tolerance_deg);
  return move;
}

inline ProgramMove arc(const Words& from, const Vec3& centre, double sweep_rad, double rise,
                       double tolerance_mm = 0.01) {
  const Vec3 radial = from.head<3>() - centre;
  Words to = from;
  to.head<3>() = centre + rot_z(sweep_rad) * radial + Vec3(0, 0, rise);
  ProgramMove move = line(from, to, tolerance_mm);
  move.kind = ProgramMove::Kind::kArc;
  move.arc_centre = centre;
  move.arc_axis = kUp;
  move.arc_sweep_rad = sweep_rad;
  return move;
}

}  // namespace trn
