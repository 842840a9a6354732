#pragma once

#include <array>

#include "core/axes.h"
#include "core/realtime.h"

namespace trn {

/// The way that jogs have led away from a place, as the corners of a line of straights, so that it can be
/// driven back. Corners are places where the machine has been. What was driven lies within two zones of the
/// straights between them: a zone is kZone_mm of a linear joint or kZone_rad of a rotary one. Ways that were
/// driven back again are forgotten.
class WayOut {
 public:
  static constexpr double kZone_mm = 0.05, kZone_rad = 0.0005;

  /// `joints` tells which are linear and which are rotary.
  explicit WayOut(const Joints& joints);

  /// Begins anew at `place`, mm or rad.
  void begin(const JointVec& place) TRN_RT;
  /// The machine has come to `q` since the last call, or the beginning.
  void visit(const JointVec& q) TRN_RT;
  /// The way goes on from `q`, which is a corner of it.
  void turn_at(const JointVec& q) TRN_RT;
  /// Nearly no room for corners is left: jogs must end.
  bool full() const TRN_RT { return count_ >= kCorners - kReserve; }

  /// Corners, with the place where it began as the first.
  int count() const TRN_RT { return count_; }
  const JointVec& last() const TRN_RT { return corners_[static_cast<std::size_t>(count_ - 1)]; }
  /// The machine has come back to the last corner; the first one stays.
  void go_back() TRN_RT;

 private:
  static constexpr int kCorners = 256;
  static constexpr int kReserve = 64;  // corners of jogs that slow down

  JointVec weighed(const JointVec& q) const TRN_RT { return q.cwiseProduct(weights_); }
  double distance_from_line(const JointVec& from_corner) const TRN_RT;
  bool leads_back(const JointVec& q) const TRN_RT;
  void set_off_anew() TRN_RT { has_direction_ = false; }

  JointVec weights_;  ///< a zone is 1
  std::array<JointVec, kCorners> corners_;
  int count_ = 0;
  JointVec before_;     ///< the place of the last call
  JointVec direction_;  ///< of the straight from the last corner, weighed, of length 1
  bool has_direction_ = false;
};

}  // namespace trn
