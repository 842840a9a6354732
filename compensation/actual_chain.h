#pragma once

#include <array>
#include <optional>
#include <vector>

#include "compensation/spline.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/realtime.h"

namespace trn {

/// Six small errors of an axis, ISO 230-1: three offsets (mm) and three tilts (rad) along and about the
/// directions of the machine frame.
struct SixErrors {
  Vec3 offset = Vec3::Zero();
  Vec3 tilt = Vec3::Zero();
};

/// The same as functions of the axis' own position (mm or rad): EXX, EYX, .. ECX of axis X, and so on.
struct ErrorTables {
  std::array<Spline, 3> offset, tilt;
  SixErrors at(double q) const TRN_RT;
};

/// How a small tilt becomes a matrix: first order, 1 + [tilt]x (the published model), or a true rotation.
enum class TiltModel : unsigned char { kLinear, kExact };

/// One axis of the actual machine, and the fixed offset in front of it.
struct ActualAxis {
  int joint = -1;  ///< -1: a fixed offset only
  JointKind kind = JointKind::kLinear;
  Vec3 direction = Vec3::UnitZ();
  Vec3 offset_mm = Vec3::Zero();
  SixErrors location;  ///< position-independent (PIGE); a linear axis' tilts (squareness) turn its direction
  std::vector<ErrorTables> tables;  ///< none or one
};

/// A serial machine with its geometric errors. Each axis: X = E(location) Trans(offset) E(table) Motion for a
/// rotary axis, E Trans Motion E(table) for a linear one (the tilts act about the moving point). Both
/// branches run from the machine base outwards: X_MB along the work branch, X_MS along the tool branch; the
/// errors of a chain of axes multiply in this order. Source: docs/sources.md S1.2; names ISO 230-1.
class ActualChain {
 public:
  /// An affine map: in the linear model A is not quite a rotation.
  struct Affine {
    Mat3 A = Mat3::Identity();
    Vec3 p = Vec3::Zero();
  };
  /// Where a joint of a branch acts: through `place` (M, mm) along or about `axis` (M).
  struct JointFrame {
    Vec3 axis, place;
    bool rotary = false, in_work_branch = false;
  };
  struct Frames {
    Affine X_MB, X_MS;
    std::array<JointFrame, kMaxJoints> joint;
  };

  std::vector<ActualAxis> tool, work;
  std::optional<Mat3> R_MS;  ///< the spindle's turn at home, as in SerialBranches, where it has one
  TiltModel model = TiltModel::kLinear;

  /// Both branches at joints q, errors included.
  void evaluate(const JointVec& q, Frames& out) const TRN_RT;
  /// Bound of the angle between nominal and actual tool axis, rad.
  double tilt_bound() const;
};

/// The branches of [kinematics] without errors; ConfigError if the machine is not serial.
ActualChain read_chain(const Machine& machine);

/// The axis of `joint`; null if no branch has it.
ActualAxis* find_axis(ActualChain& chain, int joint);

}  // namespace trn
