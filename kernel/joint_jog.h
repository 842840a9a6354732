#pragma once

#include <vector>

#include "core/axes.h"
#include "core/machine.h"
#include "core/realtime.h"

namespace trn {

/// Periods between two motions, so that the jerk of one's end and of the other's beginning do not meet.
inline constexpr int kStillPeriods = 3;

/// Where a joint that stands at `from` ends when it is jogged by `way`: at its limit at the latest; one that
/// stands outside may come back, and goes no further out. mm or rad.
double jog_target(const JointLimit& limit, double from, double way) TRN_RT;

/// The mean of the last values, at most as many as it has room for; before the first one all were 0.
class MovingMean {
 public:
  explicit MovingMean(int room) : values_(static_cast<std::size_t>(room)) {}
  void restart(int count) TRN_RT;
  double push(double value) TRN_RT;

 private:
  std::vector<double> values_;
  int count_ = 1, filled_ = 0, next_ = 0;
  double sum_ = 0;
};

/// Jogs: every joint by itself, towards a target that may move on at any moment, as under a held button or a
/// hand wheel.
///
/// A demand goes to the target at constant speed v, and what the joint does is the mean of the demand's last
/// n_a values, averaged once more over n_j periods. With the period T the joint's acceleration is so at most
/// v / (n_a T) and its jerk at most 2 v / (n_a n_j T^2), whatever the operator does, and both are chosen to
/// be the joint's limits. A mean lies between its values: the joint passes no target. Where the demand turns
/// round, it first stands for n_a periods.
class JointJog {
 public:
  JointJog(const Joints& joints, double period_s);

  /// All joints have come to rest here, mm or rad. A jog uses the whole jerk from its first period on, so it
  /// waits `kStillPeriods`, however long they have stood: a replay does not know that.
  void begin(const JointVec& from) TRN_RT;
  /// The joint's target moves on by `way` (mm or rad), but not out of its range; 0: the joint stops. `speed`:
  /// per s, 0: a tenth of the joint's limit. One that moves already does not become faster than it began.
  void move_on(int joint, double way, double speed) TRN_RT;
  /// All joints stop.
  void stop() TRN_RT;
  /// One period at this share of the speeds, 0 to 1; the joints at its end, mm or rad.
  JointVec step(double rate) TRN_RT;
  /// No joint moves any more.
  bool ended() const TRN_RT;

 private:
  struct Chase {
    explicit Chase(int room) : first(room), second(room) {}
    MovingMean first, second;
    int first_count = 1, second_count = 1;
    double speed = 0, speed_max = 0;  ///< per s
    double origin = 0;                ///< where it last stood, mm or rad
    double demand = 0, target = 0;    ///< from there
    double direction = 0;             ///< of the demand's last step
    int still = 0;                    ///< periods since
    bool moves = false;
  };

  double time_constant_s(int joint, double speed) const TRN_RT;
  void set_off(int joint, double speed) TRN_RT;
  double follow(Chase& chase, double rate) const TRN_RT;

  Joints joints_;
  double period_s_;
  std::vector<Chase> chases_;
  JointVec q_;
  int wait_ = 0;  ///< periods until the first step
};

}  // namespace trn
