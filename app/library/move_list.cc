#include "app/library/move_list.h"

#include <algorithm>
#include <cmath>

namespace trn {

namespace {

trunnion::Move::Kind kind_of(ProgramMove::Kind kind) {
  if (kind == ProgramMove::Kind::kTraverse) return trunnion::Move::Kind::rapid;
  return kind == ProgramMove::Kind::kFeed ? trunnion::Move::Kind::feed : trunnion::Move::Kind::arc;
}

}  // namespace

void MoveList::move(const ProgramMove& move) {
  trunnion::Move& out = moves.emplace_back();
  out.kind = kind_of(move.kind);
  out.line = move.source.line;
  std::copy_n(move.from.data(), out.from.size(), out.from.begin());
  std::copy_n(move.to.data(), out.to.size(), out.to.begin());
  if (move.kind == ProgramMove::Kind::kArc) {
    std::copy_n(move.arc_centre.data(), out.arc_centre.size(), out.arc_centre.begin());
    std::copy_n(move.arc_axis.data(), out.arc_axis.size(), out.arc_axis.begin());
    out.arc_sweep_rad = move.arc_sweep_rad;
  }
  const bool feed = move.kind != ProgramMove::Kind::kTraverse && std::isfinite(move.feed.tip_mm_s);
  if (feed) out.feed_mm_s = move.feed.tip_mm_s;
  if (move.mode == PathMode::kContinuous) out.tolerance_mm = move.tolerance_mm;
}

}  // namespace trn
