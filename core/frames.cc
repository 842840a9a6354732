#include "core/frames.h"

#include <cmath>

namespace trn {

Mat3 rot_x(double angle_rad) TRN_RT {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  Mat3 R;
  R << 1, 0, 0, 0, c, -s, 0, s, c;
  return R;
}

Mat3 rot_y(double angle_rad) TRN_RT {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  Mat3 R;
  R << c, 0, s, 0, 1, 0, -s, 0, c;
  return R;
}

Mat3 rot_z(double angle_rad) TRN_RT {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad);
  Mat3 R;
  R << c, -s, 0, s, c, 0, 0, 0, 1;
  return R;
}

}  // namespace trn
