#pragma once

#include <deque>
#include <memory>
#include <vector>

#include "interp/plan/lanes.h"
#include "interp/plan/speed/joint_curve.h"
#include "interp/plan/speed/path_sampler.h"
#include "interp/plan/stages.h"

namespace trn::speed {

/// b = (ds/dt)^2 and a = d2s/dt2 at one place.
struct SpeedState {
  double b = 0, a = 0;
};

/// A group of samples at which the law is judged: where they lie, as shares of their interval, and their
/// bounds on b.
struct JudgedSamples {
  Lanes share, b_max;
};

/// One joint's derivatives at a group of samples: q' and q'' over its limit of acceleration, q''' over that
/// of jerk.
struct JudgeRow {
  Lanes d1, d2, d3;
};

/// One interval of the grid on which the time law is sought: path parameter [s, s + h] of the stretch, with
/// the samples that the law must respect in it, first one at its left end, last one at its right end.
struct GridInterval {
  double s = 0, h = 0;
  double time_est_s = 0;  ///< roughly how long the machine will need
  double b_est = 0;       ///< roughly (ds/dt)^2 in its middle
  LocalBound bound;       ///< the least over its samples
  std::vector<PathSample> samples;
  std::vector<JudgedSamples> judged;  ///< made and kept by limit_use; empty before
  std::vector<JudgeRow> judge;        ///< the same: [group of samples][joint]
};

/// Time between nodes at one place, and for how long it stays the same before it may grow.
struct NodeSpacing {
  double spacing_s = 1e9, plateau_s = 0;
};

/// A piece waiting for its grid.
struct PendingPiece {
  PlanPiece plan;
  JointCurve curve;
  double s = 0;               ///< of its start in the stretch
  double spacing_s = 0;       ///< time between nodes that it wants
  double spacing_most_s = 0;  ///< greatest time between nodes, far from its ends, that its curvature allows
  /// Sums of the changes of 3 q'' a and of q''' along the piece, over the joints' jerk; a: the local bound of
  /// d2s/dt2.
  double variation2 = 0, variation3 = 0;
  struct ProfilePoint {
    double s = 0;
    LocalBound bound;
    double b_est = 0, a_est = 0;
    double ramp = 0;  ///< e + d of P8: distance from a slow point and the path from rest to its speed
  };
  std::vector<ProfilePoint> profile;  ///< estimated speed profile from start to end, coarse
  std::vector<PathSample> samples;    ///< at the points of the profile
};

/// Lays the grid over a stretch. Nodes lie about evenly in time at an estimated speed, closer where the
/// joints' derivatives change, and at borders of pieces unless the pieces are tiny. The grid works ahead of
/// the time law by `lookahead_s`, so that the estimate knows of slow places to come.
///
/// Out of a slow place the machine accelerates as out of a standstill (P8 of docs/planner.md): with e the
/// path from rest to the slow speed v, e = v sqrt(2 v / jerk), (ds/dt)^2 grows as (e + d)^(4/3) with the
/// distance d. No interval is longer than a share of this ramp e + d, whatever the time between nodes. A
/// longer one would have the slow place's speed all along.
class PathGrid {
 public:
  PathGrid(const PathSampler& sampler, double spacing_s, double lookahead_s);

  void begin_stretch();
  /// Appends a piece with its curve, which is taken. Throws ProgramError as PathSampler; the grid so far
  /// stays valid.
  void add(const PlanPiece& piece, JointCurve& curve);
  /// Lays the grid over all pieces whose future is known well enough; all when `to_end`, half when
  /// `force`. False: nothing was laid.
  bool lay(bool to_end, bool force);

  std::deque<GridInterval>& intervals() { return intervals_; }
  const std::deque<GridInterval>& intervals() const { return intervals_; }
  /// The first `count` intervals are done with.
  void drop_front(size_t count);

 private:
  void estimate(bool to_end);
  static void sweep(std::vector<PendingPiece::ProfilePoint*>& all, SpeedState from, bool backwards);
  void find_ramps(std::vector<PendingPiece::ProfilePoint*>& all) const;
  void grade_from(NodeSpacing rest, bool backwards);
  double wanted_spacing(PendingPiece& pending) const;
  /// What an interval of the piece takes at most, next to its slowest place.
  struct IntervalSize {
    double time_s = 0;  ///< at the piece's mean speed
    double length = 0;  ///< where a slow place asks for it, or else 0
  };
  static IntervalSize wanted_size(const PendingPiece& pending, double spacing_s);
  double filled(const IntervalSize& wanted) const;
  void lay_piece(const PendingPiece& pending, double spacing_s, NodeSpacing after, bool last);
  void append_interval(const PendingPiece& pending, double s0, double s1, double time_s, bool merge);
  GridInterval fresh_interval();
  std::unique_ptr<PendingPiece> fresh_piece(const PlanPiece& piece, JointCurve& curve);
  void refine(const PendingPiece& pending, GridInterval& g);
  void put_interval(GridInterval&& by, bool merge);
  void append_short(const PendingPiece& pending, double time_s);
  double pending_time() const;

  const PathSampler& sampler_;
  double spacing_s_, lookahead_s_;
  std::deque<std::unique_ptr<PendingPiece>> pending_;
  std::deque<GridInterval> intervals_;
  std::vector<std::unique_ptr<PendingPiece>> spare_pieces_;  ///< done with: their storage is used again
  std::vector<GridInterval> spare_;                          ///< the same
  std::vector<PathSample> finer_;
  std::vector<double> scratch_;  ///< positions or times in a piece
  double s_end_ = 0;
  double pending_time_s_ = 0;   ///< of pending_, at least
  double lay_from_s_ = 0;       ///< of pending_time_s_: with less, not enough is known to lay any piece
  NodeSpacing spacing_before_;  ///< of the interval laid last
  SpeedState before_;           ///< estimate at the start of pending_
  double ramp_before_ = 1e30;   ///< ramp there
  bool merge_open_ = false;     ///< the last interval still takes in tiny pieces
};

}  // namespace trn::speed
