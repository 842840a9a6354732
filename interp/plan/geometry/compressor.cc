#include "interp/plan/geometry/compressor.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/frames.h"

namespace trn {

namespace {

constexpr double kCornerCos = 0.82;    // 35 degrees: never a part of a curve
constexpr double kStandingTip = 1e-6;  // mm per mm or degree of path
constexpr double kLongLine = 12.0;     // mm (degrees): stays a line but for its ends
constexpr double kLineTail = 4.0;      // that much of a long line's end belongs to the curve beside it
constexpr double kIsolatedShare =
    0.2;                              // of its sides: a blend that wants less is a corner, no part of a curve
constexpr size_t kRunMin = 4;         // fewer moves are not worth a curve
constexpr size_t kWindow = 1024;      // moves
constexpr size_t kWindowMax = 32768;  // bounds the memory
constexpr int kOverlap = 10;          // spans of a window that the next one may change
constexpr double kBorderShift = 1e-3;  // of a move's time that a moved border may cost it
constexpr double kToleranceKept =
    0.98;  // of what a curve leaves of the tolerance, for the blends at its ends
constexpr double kInverseTimeShare = 0.998;  // for what a border is still off
constexpr double kBorderRoom = 0.45;         // of a move: how far its border may lie from its vertex
constexpr int kBorderSteps = 2;              // of Newton's
constexpr double kFeedSpread = 1.005;        // moves whose feeds differ by less share a piece

bool is_run_material(const PathItem& item) {
  return item.mode == PathMode::kContinuous && item.piece.kind == PathPiece::Kind::kLine &&
         !item.outputs.any() && item.tolerance_mm > 0 &&
         (item.tolerance_rad > 0 || item.piece.c[1].tail<3>().isZero(0));
}

// A corner at which the vertex blend uses its whole tolerance without coming near the next vertices.
bool is_isolated(const Words& turn, double length_before, double length_after, double tol_mm,
                 double tol_rad) {
  const double span = kIsolatedShare * std::min(length_before, length_after);
  return kCornerMiss * span * turn.head<3>().norm() >= tol_mm ||
         (tol_rad > 0 && kCornerMiss * span * turn.tail<3>().norm() >= tol_rad);
}

// A sharp turn of the path, and of the tip's own path where the tip moves. A turn of the path alone is no
// corner: wherever a surface is curved, the speed of the rotary words against the tip's changes within few
// moves, while the tip goes straight on.
bool is_sharp(const Words& before, const Words& after) {
  if (path_dot(before, after) >= kCornerCos) return false;
  const Vec3 tip0 = before.head<3>(), tip1 = after.head<3>();
  const double sizes = tip0.norm() * tip1.norm();
  return sizes < kStandingTip || tip0.dot(tip1) < kCornerCos * sizes;
}

PathItem part_of(const PathItem& line, double from, double to) {
  TRN_CHECK(from >= 0 && to > from);
  PathItem part = line;
  part.piece = cut(line.piece, from, to);
  return part;
}

bool alike(double a, double b) { return a == b || (a <= b * kFeedSpread && b <= a * kFeedSpread); }

bool alike(const FeedLimit& a, const FeedLimit& b) {
  return alike(a.tip_mm_s, b.tip_mm_s) && alike(a.rotary_rad_s, b.rotary_rad_s) &&
         alike(a.path_units_s, b.path_units_s) && a.overrides == b.overrides;
}

FeedLimit lower(const FeedLimit& a, const FeedLimit& b) {
  return {std::min(a.tip_mm_s, b.tip_mm_s), std::min(a.rotary_rad_s, b.rotary_rad_s),
          std::min(a.path_units_s, b.path_units_s), a.overrides};
}

FeedLimit higher(const FeedLimit& a, const FeedLimit& b) {
  return {std::max(a.tip_mm_s, b.tip_mm_s), std::max(a.rotary_rad_s, b.rotary_rad_s),
          std::max(a.path_units_s, b.path_units_s), a.overrides};
}

// The speed du/dt at which a move takes its programmed time. The move is `units` long in its own parameter
// and `u` in the run's.
double speed_of(const PathItem& item, double units, double u) {
  const Words along = item.piece.c[1] * units;
  const FeedLimit& feed = item.feed;
  return u / std::max({along.head<3>().norm() / feed.tip_mm_s, along.tail<3>().norm() / feed.rotary_rad_s,
                       units / feed.path_units_s});
}

}  // namespace

void Compressor::add(const PathItem& item) {
  if (!is_run_material(item)) {
    fit_all(RunEnd::kCorner);
    emit(item);
    return;
  }
  const bool is_long = item.piece.length > kLongLine;
  if (in_run() && !continues_run(item)) fit_all(RunEnd::kCorner);
  if (is_long) {
    add_long_line(item);
    return;
  }
  if (!in_run()) start_run(item);
  const double length = item.piece.length;
  append(item, length, run_length(length * item.piece.c[1]));
  if (moves_.size() >= window_) fit_next(false, RunEnd::kPoint);
}

void Compressor::flush() {
  fit_all(RunEnd::kPoint);
  at_rest_ = true;
}

bool Compressor::continues_run(const PathItem& item) const {
  if (pattern_.context != item.context || pattern_.rapid != item.rapid ||
      pattern_.tolerance_mm != item.tolerance_mm || pattern_.tolerance_rad != item.tolerance_rad)
    return false;
  if (is_sharp(direction_, item.piece.c[1])) return false;
  return !is_isolated(item.piece.c[1] - direction_, last_length_, item.piece.length, item.tolerance_mm,
                      item.tolerance_rad);
}

void Compressor::start_run(const PathItem& item) {
  pattern_ = item;
  pattern_.tolerance_used = 0;
  origin_ = item.piece.c[0];
  vertices_.assign(1, {0, Words::Zero()});
  moves_.clear();
  lead_in_.reset();
  head_.reset();
  fallback_.clear();
  window_ = kWindow;
  cut_at_window_ = false;
}

// Appends the first `length` of a line to the run, in which it is `u` long.
void Compressor::append(const PathItem& item, double length, double u) {
  TRN_CHECK(length > 0 && u > 0);
  TRN_CHECK(!vertices_.empty());
  vertices_.push_back({vertices_.back().u + u, item.piece.at(length) - origin_, item.tolerance_used});
  Move& move = moves_.emplace_back(Move{item.feed, speed_of(item, length, u), length / u, item.source});
  move.feed.path_units_s /= move.units_per_u;
  direction_ = item.piece.c[1];
  last_length_ = item.piece.length;
}

// A long line: its first kLineTail ends the run before it, its last kLineTail begins another. There the run's
// parameter is the line's own length, so that curve and line join with three derivatives by the same
// parameter.
void Compressor::add_long_line(const PathItem& line) {
  PathItem rest = line;
  if (moves_.size() + 1 >= kRunMin) {
    append(line, kLineTail, kLineTail);
    fit_all(RunEnd::kOnLine);
    rest = part_of(line, kLineTail, line.piece.length);
  } else if (in_run()) {
    fit_all(RunEnd::kPoint);
  }
  const PathItem tail = part_of(rest, rest.piece.length - kLineTail, rest.piece.length);
  start_run(tail);
  append(tail, kLineTail, kLineTail);
  last_length_ = line.piece.length;
  lead_in_ = rest;
}

void Compressor::fit_all(RunEnd end) {
  while (in_run()) fit_next(true, end);
}

// Fits a curve to a window of the run and emits what is final of it: all when the run ends here, else the
// spans that the next window cannot change. Where no curve fits, falls back to the fit before or to lines.
// Every call makes progress: it emits something, or changes the window in a direction that ends.
void Compressor::fit_next(bool last, RunEnd end) {
  const size_t count = std::min(moves_.size(), window_);
  const bool whole = last && count == moves_.size();
  if (count < kRunMin && !head_) return emit_lines(count);
  const RunFit fit = fit_front(count, whole ? end : (cut_at_window_ ? RunEnd::kCorner : RunEnd::kPoint));
  if (!fit.ok) return fall_back(count, fit.worst_vertex);
  emit_lead_in();
  if (!whole && !cut_at_window_ && count < kWindowMax) return emit_front(fit, count);
  emit_items(items_of(fit, 0, fit.spline.span_count()), whole && end == RunEnd::kOnLine);
  head_.reset();
  fallback_.clear();
  drop_front(count);
  window_ = std::min(kWindow, 2 * count);
  cut_at_window_ = false;
}

RunFit Compressor::fit_front(size_t count, RunEnd end) const {
  RunRequest request;
  request.vertices = {vertices_.data(), count + 1};
  const RunEnd start = at_rest_ ? RunEnd::kPoint : RunEnd::kCorner;
  request.start = head_ ? RunEnd::kFrozen : (lead_in_ ? RunEnd::kOnLine : start);
  request.end = end;
  request.head = head_ ? &*head_ : nullptr;
  request.tolerance_mm = pattern_.tolerance_mm;
  request.tolerance_rad = pattern_.tolerance_rad;
  return fit_run(request);
}

void Compressor::emit_front(const RunFit& fit, size_t count) {
  const int spans = fit.spline.span_count();
  if (spans < 2 * kOverlap) {  // too few to be sure of any: take more moves
    window_ = std::min(kWindowMax, 2 * count);
    return;
  }
  emit_items(items_of(fit, 0, spans - kOverlap), true);
  fallback_ = items_of(fit, spans - kOverlap, spans);
  fallback_end_ = count;
  freeze(fit, spans - kOverlap);
  window_ = moves_.size() + kWindow;
}

// No curve fits the first `count` moves. If a window before this one was fitted, the rest of that fit is
// emitted and the run starts anew at its end. If not, a shorter window up to the worst vertex is tried, and
// lines at last.
void Compressor::fall_back(size_t count, size_t worst_vertex) {
  if (head_) {
    emit_items(fallback_, false);
    fallback_.clear();
    head_.reset();
    drop_front(fallback_end_);
    window_ = kWindow;
    return;
  }
  const size_t part = std::clamp<size_t>(worst_vertex, 1, count - 1);
  if (part < kRunMin) return emit_lines(part);
  window_ = part;
  cut_at_window_ = true;
}

void Compressor::emit_lines(size_t count) {
  for (size_t i = 0; i < count; ++i) {
    PathItem item = pattern_;
    item.feed = moves_[i].feed;
    item.feed.path_units_s *= moves_[i].units_per_u;
    item.source = item.last_source = moves_[i].source;
    item.tolerance_used = vertices_[i + 1].tolerance_used;
    if (i == 0 && lead_in_)
      item.piece = lead_in_->piece;
    else
      item.piece = make_line(origin_ + vertices_[i].y, origin_ + vertices_[i + 1].y);
    emit(item);
  }
  lead_in_.reset();
  drop_front(count);
  window_ = std::min(kWindow, std::max<size_t>(2 * window_, 16));
  cut_at_window_ = false;
}

// The line before the run's first chord, up to where the curve starts: its tail has become a part of the
// curve.
void Compressor::emit_lead_in() {
  if (!lead_in_) return;
  PathItem line = part_of(*lead_in_, 0, lead_in_->piece.length - kLineTail);
  line.joins_next = true;
  emit(line);
  lead_in_.reset();
}

std::vector<PathItem> Compressor::items_of(const RunFit& fit, int from, int to) {
  std::vector<PathItem> items;
  std::vector<PathPiece> curve;
  PathPoint start = fit.spline.derivatives_at_break(from);
  start.y += origin_;
  for (int k = from; k < to; ++k) {
    PathPoint end = fit.spline.derivatives_at_break(k + 1);
    end.y += origin_;
    curve.push_back(make_hermite(start, end, fit.spline.at_break(k + 1) - fit.spline.at_break(k)));
    start = end;
  }
  find_borders(curve, fit.spline.at_break(from));
  for (int k = from; k < to; ++k)
    append_parts(curve[static_cast<size_t>(k - from)], fit.spline.at_break(k),
                 fit.usage[static_cast<size_t>(k)].worst(), items);
  return items;
}

// Where moves have times of their own (G93), the border between two of them is the place of the curve that is
// abreast of their vertex. At the vertex's own parameter the curve may be early or late by a share of the
// tolerance, which is much of a short move.
void Compressor::find_borders(const std::vector<PathPiece>& curve, double u0) {
  borders_.clear();
  for (const RunVertex& v : vertices_) borders_.push_back(v.u);
  size_t i = 1;
  for (const PathPiece& piece : curve) {
    for (; i + 1 < vertices_.size() && vertices_[i].u < u0 + piece.length; ++i)
      if (vertices_[i].u >= u0 &&
          (std::isfinite(moves_[i - 1].feed.path_units_s) || std::isfinite(moves_[i].feed.path_units_s)))
        borders_[i] = border_of(i, piece, u0);
    u0 += piece.length;
  }
}

// Newton's method for the place where the curve passes the bisecting plane of the two moves' directions, in
// the path norm. The place stays within kBorderRoom of the moves beside it, so that borders keep their order.
double Compressor::border_of(size_t vertex, const PathPiece& piece, double u0) const {
  const RunVertex &before = vertices_[vertex - 1], &here = vertices_[vertex], &after = vertices_[vertex + 1];
  const Words in = here.y - before.y, out = after.y - here.y;
  const Words across = in / path_norm(in) + out / path_norm(out);
  const double room = kBorderRoom * std::min(here.u - before.u, after.u - here.u);
  double u = here.u;
  for (int step = 0; step < kBorderSteps; ++step) {
    const PathPoint p = piece.derivatives(u - u0);
    const double slope = path_dot(p.d1, across);
    if (slope <= 0) return here.u;
    u = std::clamp(u - path_dot(p.y - origin_ - here.y, across) / slope, here.u - room, here.u + room);
  }
  return u;
}

// The move's feed limit by the run's parameter. Its time counts between the borders, which may lie closer or
// farther apart than the vertices.
FeedLimit Compressor::limit_of(size_t move) const {
  FeedLimit limit = moves_[move].feed;
  limit.path_units_s *=
      kInverseTimeShare * (borders_[move + 1] - borders_[move]) / (vertices_[move + 1].u - vertices_[move].u);
  return limit;
}

size_t Compressor::move_at(double u) const {
  const auto after = std::upper_bound(borders_.begin() + 1, borders_.end() - 1, u);
  return static_cast<size_t>(after - borders_.begin()) - 1;
}

// Cuts a span that begins at u0 where the programmed speed changes. Moves whose limits differ by less than
// kFeedSpread share a part, which gets the least of them.
std::vector<Compressor::Part> Compressor::parts_of(double u0, double length) const {
  std::vector<Part> parts;
  size_t i = move_at(u0);
  for (double from = 0; from < length; from = parts.back().to) {
    Part part{from, length, i, i + 1, limit_of(i)};
    FeedLimit highest = part.feed;
    while (part.end < moves_.size() && borders_[part.end] - u0 < length) {
      const FeedLimit next = limit_of(part.end);
      if (!alike(next, part.feed) || !alike(next, highest)) {
        part.to = borders_[part.end] - u0;
        break;
      }
      part.feed = lower(part.feed, next);
      highest = higher(highest, next);
      ++part.end;
    }
    i = part.end;
    parts.push_back(part);
  }
  settle_ends(length, parts);
  return parts;
}

// A border near the end of a span would leave a part so short that the speed stage's nodes there would be
// wasted. The border is moved into the faster of the two moves (never into the slower, which would then be
// driven too fast), or dropped if the short part is the faster one.
void Compressor::settle_ends(double length, std::vector<Part>& parts) const {
  const auto settle = [&](bool front) {
    if (parts.size() < 2) return;
    const size_t n = parts.size();
    Part &end = parts[front ? 0 : n - 1], &beside = parts[front ? 1 : n - 2];
    const size_t of_end = front ? end.end - 1 : end.first, of_beside = front ? beside.first : beside.end - 1;
    const double size = end.to - end.from;
    if (moves_[of_end].speed < moves_[of_beside].speed) {
      const double wanted = std::min(shift_max(of_beside, of_end), (beside.to - beside.from) / 2);
      if (size >= wanted) return;
      (front ? end.to : end.from) = front ? wanted : length - wanted;
      (front ? beside.from : beside.to) = front ? wanted : length - wanted;
    } else if (size <= shift_max(of_end, of_beside)) {
      beside.feed = lower(beside.feed, end.feed);
      (front ? beside.from : beside.to) = front ? 0 : length;
      (front ? beside.first : beside.end) = front ? end.first : end.end;
      parts.erase(front ? parts.begin() : parts.end() - 1);
    }
  };
  settle(true);
  settle(false);
}

// How much of the faster of two moves may be driven at the speed of the slower, so that it costs kBorderShift
// of the faster one's time: less, the slower the other is.
double Compressor::shift_max(size_t fast, size_t slow) const {
  const double ratio = moves_[slow].speed / moves_[fast].speed;
  return kBorderShift * (vertices_[fast + 1].u - vertices_[fast].u) * (std::isfinite(ratio) ? ratio : 1);
}

// One span of the curve, cut where the programmed speed changes.
void Compressor::append_parts(const PathPiece& piece, double u0, double usage,
                              std::vector<PathItem>& out) const {
  PathItem item = pattern_;
  item.tolerance_mm *= kToleranceKept * (1 - std::min(usage, 1.0));
  item.tolerance_rad *= kToleranceKept * (1 - std::min(usage, 1.0));
  for (const Part& part : parts_of(u0, piece.length)) {
    item.feed = part.feed;
    item.source = moves_[part.first].source;
    item.last_source = moves_[part.end - 1].source;
    item.piece = part.to - part.from == piece.length ? piece : cut(piece, part.from, part.to);
    out.push_back(item);
  }
}

void Compressor::emit_items(const std::vector<PathItem>& items, bool joins_next) {
  for (size_t i = 0; i < items.size(); ++i) {
    PathItem item = items[i];
    item.joins_next = joins_next || i + 1 < items.size();
    emit(item);
  }
}

void Compressor::emit(const PathItem& item) {
  next_.add(blend_ready(item));
  at_rest_ = false;
}

void Compressor::freeze(const RunFit& fit, int at) {
  head_.emplace();
  std::copy_n(fit.spline.knots.begin() + at, head_->knots.size(), head_->knots.begin());
  std::copy_n(fit.spline.coefficients.begin() + at, head_->coefficients.size(), head_->coefficients.begin());
  const double start = head_->knots[5];
  size_t passed = 0;
  while (vertices_[passed + 1].u <= start) ++passed;
  drop_front(passed);
  fallback_end_ -= passed;
  for (double& knot : head_->knots)
    knot -= start;  // u stays small, and its digits fine, however long the run is
  for (RunVertex& v : vertices_) v.u -= start;
}

void Compressor::drop_front(size_t count) {
  vertices_.erase(vertices_.begin(), vertices_.begin() + static_cast<std::ptrdiff_t>(count));
  moves_.erase(moves_.begin(), moves_.begin() + static_cast<std::ptrdiff_t>(count));
}

}  // namespace trn
