#pragma once

#include <array>

namespace trn {

/// What a value did in the last period: mm or rad, per s, s2 and s3.
struct Derivatives {
  double velocity = 0, acceleration = 0, jerk = 0;
};

/// First, second and third backward differences of a value that is sampled once a period. Each is a weighted
/// mean of the derivative over its samples, so a motion within limits never shows more. The value counts as
/// at rest before the first sample.
class Differencer {
 public:
  /// The next sample begins anew, at rest where it is.
  void restart() { fresh_ = true; }

  /// `q` is one period behind the last sample. Sums are ordered so that a value at rest gives exactly zero.
  Derivatives next(double q, double period_s) {
    if (fresh_) past_.fill(q);
    fresh_ = false;
    const double d0 = q - past_[0], d1 = past_[0] - past_[1], d2 = past_[1] - past_[2];
    past_ = {q, past_[0], past_[1]};
    return {d0 / period_s, (d0 - d1) / (period_s * period_s),
            ((d0 - d1) - (d1 - d2)) / (period_s * period_s * period_s)};
  }
  /// The last sample.
  double value() const { return past_[0]; }

 private:
  std::array<double, 3> past_{};  // newest first
  bool fresh_ = true;
};

}  // namespace trn
