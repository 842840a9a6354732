#pragma once

#include "core/frames.h"
#include "core/units.h"
#include "interp/gcode/axis_words.h"

namespace trn {

/// Where the program's coordinate system P lies in the machine frame M; lengths mm, angles degrees. From
/// inside out: tilted plane, G92/G52, turn about Z, G54..G59.3.
struct WorkFrame {
  MmWords g5x;
  MmWords g92;
  double rotation_deg = 0;
  bool tilted = false;
  Vec3 origin = Vec3::Zero();  ///< of the tilted plane
  Mat3 R_tilt = Mat3::Identity();

  /// Pose of the program frame P in M.
  Pose X_MP() const {
    const Mat3 R_turn = rotation_deg == 0 ? Mat3(Mat3::Identity()) : rot_z(rad_from_deg(rotation_deg));
    Pose X{R_turn, g5x.xyz + R_turn * g92.xyz};
    if (tilted) X = X * Pose{R_tilt, origin};
    return X;
  }
  /// Words in P -> axis coordinates in M (without tool) and back.
  MachineWords to_machine(const MmWords& program) const {
    const MmWords m = program + g5x + g92;
    return {rotation_deg != 0 || tilted ? Vec3(X_MP() * program.xyz) : m.xyz, m.abc_deg};
  }
  MmWords to_program(const MachineWords& machine) const {
    const MachineWords p = machine - g5x - g92;
    return {rotation_deg != 0 || tilted ? Vec3(inverse(X_MP()) * machine.xyz) : p.xyz, p.abc_deg};
  }
};

}  // namespace trn
