#include "interp/plan/geometry/residual_moves.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/axes.h"
#include "core/check.h"
#include "core/frames.h"
#include "core/units.h"
#include "interp/plan/geometry/path_item.h"

namespace trn {

namespace {

constexpr double kShareMax = 0.125;                           // of the tolerances: a group's length
constexpr double kMmMax = 2e-3, kRadMax = 2e-3 * kRadPerDeg;  // whatever the tolerances: more is no rounding
constexpr double kTimeMax_s = 1e-3;  // a group that the program wants to last longer is driven as it is
constexpr double kOutweighs = 4;     // least length of a neighbour over that of the group joined to it
constexpr size_t kGroupMax = 256;    // moves; bounds the memory

}  // namespace

ResidualMoves::Extent ResidualMoves::extent_of(const ProgramMove& move) {
  const Words way = move.to - move.from;
  Extent extent{way.head<3>().norm(), way.tail<3>().norm(), path_norm(way), 0};
  if (move.kind == ProgramMove::Kind::kArc) {
    const Vec3 r = move.from.head<3>() - move.arc_centre;
    const double arc = std::abs(move.arc_sweep_rad) * r.cross(move.arc_axis).norm();
    const double more = std::hypot(arc, move.arc_axis.dot(way.head<3>())) - extent.mm;
    extent.mm += std::max(more, 0.0);
    extent.path += std::max(more, 0.0);
  }
  extent.s =
      std::max({extent.mm / move.feed.tip_mm_s, extent.path / move.feed.path_units_s, move.duration_s});
  if (extent.mm == 0) extent.s = std::max(extent.s, extent.rad / move.feed.rotary_rad_s);
  return extent;
}

bool ResidualMoves::is_tiny(const Extent& extent, const ProgramMove& move) {
  return move.mode == PathMode::kContinuous && extent.mm <= std::min(kShareMax * move.tolerance_mm, kMmMax) &&
         extent.rad <= std::min(kShareMax * move.tolerance_rad, kRadMax) && extent.s <= kTimeMax_s;
}

void ResidualMoves::add(const ProgramMove& move) {
  if (!continues(move)) flush();
  const Extent own = extent_of(move), sum = sum_ + own;
  const bool tiny = is_tiny(own, move);
  if (tiny && !dense_ && group_.size() < kGroupMax && is_tiny(sum, move)) {
    group_.push_back(move);
    sum_ = sum;
    return;
  }
  dense_ = tiny;  // too many of them for a residual
  JoinedMove next{move};
  if (!tiny && outweighed_by(anchor_.move))
    join_to_anchor();
  else if (!tiny && outweighed_by(move))
    next = with_group_before(move);
  send_all();
  anchor_ = next;
  anchored_ = true;
}

void ResidualMoves::flush() {
  if (outweighed_by(anchor_.move)) join_to_anchor();
  send_all();
  dense_ = false;
}

// The move may lie in one group with the last one: the same mode, context and tolerances, and no outputs,
// which must act where the move begins.
bool ResidualMoves::continues(const ProgramMove& move) const {
  if (!anchored_ && group_.empty()) return true;
  const ProgramMove& last = group_.empty() ? anchor_.move : group_.back();
  return !move.outputs.any() && last.mode == move.mode && last.context == move.context &&
         last.tolerance_mm == move.tolerance_mm && last.tolerance_rad == move.tolerance_rad;
}

bool ResidualMoves::outweighed_by(const ProgramMove& move) const {
  const bool is_anchor = &move == &anchor_.move;
  return !group_.empty() && (anchored_ || !is_anchor) && extent_of(move).path >= kOutweighs * sum_.path;
}

double ResidualMoves::tolerance_used_by_group(const ProgramMove& move) const {
  TRN_CHECK(move.tolerance_mm > 0);
  return std::max(sum_.mm / move.tolerance_mm, sum_.rad > 0 ? sum_.rad / move.tolerance_rad : 0);
}

void ResidualMoves::join_to_anchor() {
  anchor_.move.to = group_.back().to;
  anchor_.tolerance_used += tolerance_used_by_group(anchor_.move);
  group_.clear();
  sum_ = {};
}

// An arc that starts elsewhere turns around the same centre: it may deviate by the group's length all along,
// and by as much again because a drift closes it at its end. So it loses twice the tolerance.
JoinedMove ResidualMoves::with_group_before(const ProgramMove& move) {
  JoinedMove out{move};
  out.move.from = group_.front().from;
  out.move.outputs = group_.front().outputs;
  out.tolerance_used = tolerance_used_by_group(move) * (move.kind == ProgramMove::Kind::kArc ? 2 : 1);
  group_.clear();
  sum_ = {};
  return out;
}

void ResidualMoves::send_all() {
  if (anchored_) next_.joined(anchor_);
  for (const ProgramMove& move : group_) next_.joined({move});
  anchored_ = false;
  group_.clear();
  sum_ = {};
}

}  // namespace trn
