#include "interp/plan/geometry/geometry_planner.h"

#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "core/check.h"
#include "core/frames.h"
#include "core/path.h"
#include "interp/plan/geometry/path_item.h"

namespace trn {

namespace {

constexpr double kMoveMin = 1e-9;  // shorter moves vanish; the next one starts where they started
constexpr double kGapMax = 1e-6;   // rounding of the interpreter's bookkeeping
constexpr double kMinArcSweepRad = 1e-12;

// An arc whose radius at the end differs from that at its start (rounded programs) is closed by a linear
// drift.
PathPiece close_arc(PathPiece arc, const Words& to) {
  TRN_CHECK(arc.length > 0 && to.allFinite());
  arc.c[1] += (to - arc.at(arc.length)) / arc.length;
  return arc;
}

bool is_arc(const ProgramMove& move) {
  return move.kind == ProgramMove::Kind::kArc && std::abs(move.arc_sweep_rad) > kMinArcSweepRad;
}

double length_of(const ProgramMove& move, const Words& from) {
  const double chord = path_norm(move.to - from);
  if (!is_arc(move)) return chord;
  const Vec3 r = from.head<3>() - move.arc_centre;
  return std::max(chord, std::abs(move.arc_sweep_rad) * r.cross(move.arc_axis).norm());
}

PathPiece piece_of(const ProgramMove& move) {
  if (!is_arc(move)) return make_line(move.from, move.to);
  return close_arc(make_arc(move.from, move.to, move.arc_centre, move.arc_axis, move.arc_sweep_rad), move.to);
}

PathItem item_of(const JoinedMove& joined) {
  const ProgramMove& move = joined.move;
  PathItem item;
  item.piece = piece_of(move);
  item.context = move.context;
  item.feed = move.feed;
  if (move.duration_s > 0) item.feed.path_units_s = item.piece.length / move.duration_s;
  item.rapid = move.kind == ProgramMove::Kind::kTraverse;
  item.mode = move.mode;
  item.tolerance_mm = move.tolerance_mm;
  item.tolerance_rad = move.tolerance_rad;
  item.tolerance_used = joined.tolerance_used;
  item.source = item.last_source = move.source;
  item.outputs = move.outputs;
  return item;
}

}  // namespace

GeometryPlanner::GeometryPlanner(const GeometryOptions& options, PieceSink& sink)
    : options_(options), sink_(sink), blender_(sink), compressor_(blender_), residuals_(*this) {}

Words GeometryPlanner::start_of(const ProgramMove& move) const {
  if (!end_ || context_ != move.context) return move.from;
  const double gap = path_norm(move.from - *end_);
  if (gap <= kGapMax) return *end_;
  if (at_rest_) return move.from;
  throw ProgramError(fmt::format("line {}: the move starts {} mm away from the end of the one before",
                                 move.source.line, gap));
}

void GeometryPlanner::move(const ProgramMove& move) {
  if (!move.from.allFinite() || !move.to.allFinite() || !std::isfinite(move.arc_sweep_rad))
    throw ProgramError(
        fmt::format("line {}: the move's coordinates are not finite numbers", move.source.line));
  const Words from = start_of(move);
  end_ = from;
  context_ = move.context;
  at_rest_ = false;
  outputs_.add(move.outputs);
  if (length_of(move, from) < kMoveMin) return;
  ProgramMove taken = move;
  taken.from = from;
  taken.outputs = std::exchange(outputs_, {});
  residuals_.add(taken);
  end_ = move.to;
}

void GeometryPlanner::joined(const JoinedMove& move) {
  const PathItem item = item_of(move);
  options_.compress ? compressor_.add(item) : blender_.add(blend_ready(item));
}

void GeometryPlanner::event(const QueueEvent& event, SourceLine source) {
  finish();
  sink_.event(event, source);
}

void GeometryPlanner::finish() {
  residuals_.flush();
  compressor_.flush();
  blender_.stop();
  at_rest_ = true;
}

}  // namespace trn
