#pragma once

#include "core/frames.h"
#include "core/units.h"
#include "interp/gcode/canon.h"

namespace trn {

/// Where the program's coordinate system lies in the machine frame M; lengths mm, angles degrees. From inside
/// out: tilted plane, G92/G52, turn about Z, G54..G59.3.
struct WorkFrame {
  AxisValues g5x = AxisValues::Zero();
  AxisValues g92 = AxisValues::Zero();
  double rotation_deg = 0;
  bool tilted = false;
  Vec3 origin = Vec3::Zero();  ///< of the tilted plane
  Mat3 R_tilt = Mat3::Identity();

  /// Pose of the program frame P in M.
  Pose X_MP() const {
    const Mat3 R_turn = rotation_deg == 0 ? Mat3(Mat3::Identity()) : rot_z(rad_from_deg(rotation_deg));
    Pose X{R_turn, g5x.head<3>() + R_turn * g92.head<3>()};
    if (tilted) X = X * Pose{R_tilt, origin};
    return X;
  }
  /// Program coordinates -> axis coordinates of M (without tool) and back.
  AxisValues to_machine(const AxisValues& program) const {
    AxisValues m = program + g5x + g92;
    if (rotation_deg != 0 || tilted) m.head<3>() = X_MP() * Vec3(program.head<3>());
    return m;
  }
  AxisValues to_program(const AxisValues& machine) const {
    AxisValues p = machine - g5x - g92;
    if (rotation_deg != 0 || tilted) p.head<3>() = inverse(X_MP()) * Vec3(machine.head<3>());
    return p;
  }
};

}  // namespace trn
