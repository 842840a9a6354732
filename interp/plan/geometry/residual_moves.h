#pragma once

#include <vector>

#include "interp/move.h"

namespace trn {

/// A move on its way to the path; the residual moves beside it may have been joined to it.
struct JoinedMove {
  ProgramMove move;
  double tolerance_used = 0;  ///< share of its tolerances by which it may leave the programmed path
};

/// Receives moves to which residual moves have been joined, in program order.
class JoinedSink {
 public:
  virtual ~JoinedSink() = default;
  virtual void joined(const JoinedMove& move) = 0;
};

/// Joins residual moves to their neighbours. Rounding and clipping leave moves of tenths or thousandths of a
/// micrometre in a program. They point anywhere, and a corner rounded within their length would be a stop.
///
/// In continuous mode a group of such moves, all together short against the tolerances and driven in less
/// than a millisecond, is joined to the move before it, which then ends where they end. Where there is none,
/// or it is as short as they are, the group is joined to the move after it, which starts where they start.
/// The longer move deviates by at most the group's length, and its tolerances become less by as much.
///
/// Many tiny moves in a row are no residual but a curve, and go through unchanged. So do the exact modes, and
/// moves with outputs, which act where they begin.
class ResidualMoves {
 public:
  explicit ResidualMoves(JoinedSink& next) : next_(next) {}

  /// Moves of path_norm > 0, each beginning where the one before it ended or after a stop.
  void add(const ProgramMove& move);
  /// No more moves before a stop, which is where the last one ends.
  void flush();

 private:
  /// Lengths of one or more moves, of position, rotary words and path, and their time at their own feeds.
  struct Extent {
    double mm = 0, rad = 0, path = 0, s = 0;
    Extent operator+(const Extent& by) const { return {mm + by.mm, rad + by.rad, path + by.path, s + by.s}; }
  };
  static Extent extent_of(const ProgramMove& move);
  static bool is_tiny(const Extent& extent, const ProgramMove& move);
  bool continues(const ProgramMove& move) const;
  bool outweighed_by(const ProgramMove& move) const;
  double tolerance_used_by_group(const ProgramMove& move) const;
  void join_to_anchor();
  JoinedMove with_group_before(const ProgramMove& move);
  void send_all();

  JoinedSink& next_;
  bool anchored_ = false;
  JoinedMove anchor_;               ///< the move before the group
  std::vector<ProgramMove> group_;  ///< tiny ones, undecided
  Extent sum_;                      ///< of the group
  bool dense_ = false;              ///< among many tiny moves, which go through unchanged
};

}  // namespace trn
