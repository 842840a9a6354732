#pragma once

#include <vector>

#include "core/realtime.h"

namespace trn {

/// Natural cubic spline through points of rising x: two continuous derivatives, straight beyond both ends.
/// One point is a constant, none is zero everywhere. A periodic one goes on as it began instead.
class Spline {
 public:
  Spline() = default;
  /// x strictly rising, as many y; std::invalid_argument otherwise.
  Spline(std::vector<double> x, std::vector<double> y);
  /// The last point is the first one again, a period later; std::invalid_argument unless their values agree
  /// and there are three others at least.
  static Spline periodic(std::vector<double> x, std::vector<double> y);

  double at(double x) const TRN_RT;
  double slope(double x) const TRN_RT;
  bool empty() const TRN_RT { return x_.empty(); }
  /// Greatest |value| at the points, and |slope| anywhere between them.
  double peak() const;
  double slope_max() const;

 private:
  std::size_t cell(double x) const TRN_RT;

  double placed(double x) const TRN_RT;

  std::vector<double> x_, y_, m_;  // m: second derivatives
  double period_ = 0;              // 0: none
};

}  // namespace trn
