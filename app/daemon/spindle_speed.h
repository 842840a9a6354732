#pragma once

namespace trn {

/// The spindle's real speed, from its encoder's turns.
class SpindleSpeed {
 public:
  /// Once a period: turns of the encoder, + clockwise.
  void hear(double turns, double period_s) {
    known_ = known_ || turns != 0;
    time_s_ += period_s;
    if (time_s_ < kWindow_s) return;
    rpm_ = 60 * (turns - before_) / time_s_;
    before_ = turns;
    time_s_ = 0;
  }
  /// There is an encoder: it has moved.
  bool known() const { return known_; }
  double rpm() const { return rpm_; }

 private:
  static constexpr double kWindow_s = 0.1;
  double before_ = 0, time_s_ = 0, rpm_ = 0;
  bool known_ = false;
};

}  // namespace trn
