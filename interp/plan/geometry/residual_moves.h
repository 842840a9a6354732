#pragma once

#include <vector>

#include "interp/move.h"

namespace trn {

/// A move on its way to the path, with what it took in of moves too short to be driven for themselves.
struct JoinedMove {
  ProgramMove move;
  double lost = 0;  ///< share of its tolerances that it may be off the programmed path already
};

/// Receives moves with their residual blocks joined, in program order.
class JoinedSink {
 public:
  virtual ~JoinedSink() = default;
  virtual void joined(const JoinedMove& move) = 0;
};

/// Joins residual blocks to their neighbours. What rounding and clipping leave between two moves, lines of
/// tenths or thousandths of a micrometre, points anywhere, and corners rounded within its length would be
/// stops. In continuous mode a group of such moves, short against the tolerances and driven in next to no
/// time all together, belongs to the move before it, which ends where they end; where that is none, or as
/// short as they are, to the move after it, which starts where they start. No place of that move is farther
/// from the programmed path than the group is long, and this its tolerances lose. Many tiny moves in a row
/// are no residual but a curve, and go through unchanged; so do exact modes, and moves with outputs, which
/// act where they begin.
class ResidualMoves {
 public:
  explicit ResidualMoves(JoinedSink& next) : next_(next) {}

  /// Moves of path_norm > 0, each beginning where the one before it ended or after a stop.
  void add(const ProgramMove& move);
  /// No more moves before a stop, which is where the last one ends.
  void flush();

 private:
  /// Of one or more moves: ways, and the time at their own feeds.
  struct Extent {
    double mm = 0, rad = 0, path = 0, s = 0;
    Extent operator+(const Extent& by) const { return {mm + by.mm, rad + by.rad, path + by.path, s + by.s}; }
  };
  static Extent extent_of(const ProgramMove& move);
  static bool is_tiny(const Extent& extent, const ProgramMove& move);
  bool continues(const ProgramMove& move) const;
  bool outweighed_by(const ProgramMove& move) const;
  double lost_to_group(const ProgramMove& move) const;
  void join_to_anchor();
  JoinedMove with_group_before(const ProgramMove& move);
  void send_all();

  JoinedSink& next_;
  bool anchored_ = false;
  JoinedMove anchor_;               ///< the move before the group
  std::vector<ProgramMove> group_;  ///< tiny ones, undecided
  Extent sum_;                      ///< of the group
  bool dense_ = false;              ///< among many tiny moves, which are passed on
};

}  // namespace trn
