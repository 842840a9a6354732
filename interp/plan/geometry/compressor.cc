#include "interp/plan/geometry/compressor.h"

#include <algorithm>
#include <cmath>

namespace trn {

namespace {

constexpr double kCornerCos = 0.82;     // 35 degrees: never a part of a curve
constexpr double kStandingTip = 1e-6;   // mm per mm or degree of path
constexpr double kLongLine = 12.0;      // mm (degrees): stays a line but for its ends
constexpr double kLineTail = 4.0;       // that much of a long line's end belongs to the curve beside it
constexpr double kIsolatedShare = 0.2;  // a blend wanting less of its sides than this stands alone
constexpr size_t kRunMin = 4;           // fewer moves are not worth a curve
constexpr size_t kWindow = 1024;        // moves
constexpr size_t kWindowMax = 32768;    // bounds the memory
constexpr int kOverlap = 10;            // spans of a window that the next one may change
constexpr double kShortestPart = 0.02;  // of a span; a feed's border may move by that much
constexpr double kToleranceKept =
    0.98;                             // of what a curve leaves of the tolerance, for the blends at its ends
constexpr double kFeedSpread = 1.03;  // moves whose feeds differ by less share a piece

bool is_run_material(const PathItem& item) {
  return item.mode == PathMode::kContinuous && item.piece.kind == PathPiece::Kind::kLine &&
         !item.outputs.any() && item.tolerance_mm > 0 &&
         (item.tolerance_rad > 0 || item.piece.c[1].tail<3>().isZero(0));
}

// A corner at which the vertex blend uses its whole tolerance without coming near the next vertices.
bool is_isolated(const Words& turn, double length_before, double length_after, double tol_mm,
                 double tol_rad) {
  constexpr double kLineMiss = 0.15625;  // see corner_blend.cc
  const double span = kIsolatedShare * std::min(length_before, length_after);
  return kLineMiss * span * turn.head<3>().norm() >= tol_mm ||
         (tol_rad > 0 && kLineMiss * span * turn.tail<3>().norm() >= tol_rad);
}

// A sharp turn of the path, and of the tip's way where the tip moves: how fast the rotary words turn against
// the tip changes within few moves wherever a surface bends, and where they are quick the tip may turn at
// ease.
bool is_sharp(const Words& before, const Words& after) {
  if (path_dot(before, after) >= kCornerCos) return false;
  const Vec3 tip0 = before.head<3>(), tip1 = after.head<3>();
  const double sizes = tip0.norm() * tip1.norm();
  return sizes < kStandingTip || tip0.dot(tip1) < kCornerCos * sizes;
}

PathItem part_of(const PathItem& line, double from, double to) {
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

}  // namespace

void Compressor::add(const PathItem& item) {
  if (!is_run_material(item)) {
    fit_all(RunEnd::kCorner);
    pass(item);
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
  if (!same_context(pattern_.context, item.context) || pattern_.rapid != item.rapid ||
      pattern_.tolerance_mm != item.tolerance_mm || pattern_.tolerance_rad != item.tolerance_rad)
    return false;
  if (is_sharp(direction_, item.piece.c[1])) return false;
  return !is_isolated(item.piece.c[1] - direction_, last_length_, item.piece.length, item.tolerance_mm,
                      item.tolerance_rad);
}

void Compressor::start_run(const PathItem& item) {
  pattern_ = item;
  origin_ = item.piece.c[0];
  vertices_.assign(1, {0, Words::Zero()});
  moves_.clear();
  lead_.reset();
  head_.reset();
  way_out_.clear();
  window_ = kWindow;
  cut_at_window_ = false;
}

// The first `length` of a line, which counts as `u` in the run's parameter.
void Compressor::append(const PathItem& item, double length, double u) {
  vertices_.push_back({vertices_.back().u + u, item.piece.at(length) - origin_});
  moves_.push_back({item.feed, item.line});
  direction_ = item.piece.c[1];
  last_length_ = item.piece.length;
}

// A long line: its start ends the run before it, its end may begin another. Where the curve meets the line,
// its parameter is the line's own.
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
  lead_ = rest;
}

void Compressor::fit_all(RunEnd end) {
  while (in_run()) fit_next(true, end);
}

// Fits what a window holds and hands on what is final of it; where nothing fits, lines. Always makes
// progress: hands something on, or changes the window in a direction that ends.
void Compressor::fit_next(bool last, RunEnd end) {
  const size_t count = std::min(moves_.size(), window_);
  const bool whole = last && count == moves_.size();
  if (count < kRunMin && !head_) return hand_on_lines(count);
  const RunFit fit = fit_front(count, whole ? end : (cut_at_window_ ? RunEnd::kCorner : RunEnd::kPoint));
  if (!fit.ok) return give_up(count, fit.worst_vertex);
  hand_on_lead();
  if (!whole && !cut_at_window_ && count < kWindowMax) return hand_on_front(fit, count);
  hand_on(items_of(fit, 0, fit.spline.span_count()), whole && end == RunEnd::kOnLine);
  head_.reset();
  way_out_.clear();
  drop_front(count);
  window_ = std::min(kWindow, 2 * count);
  cut_at_window_ = false;
}

RunFit Compressor::fit_front(size_t count, RunEnd end) const {
  RunRequest request;
  request.vertices = {vertices_.data(), count + 1};
  const RunEnd start = at_rest_ ? RunEnd::kPoint : RunEnd::kCorner;
  request.start = head_ ? RunEnd::kFrozen : (lead_ ? RunEnd::kOnLine : start);
  request.end = end;
  request.head = head_ ? &*head_ : nullptr;
  request.tolerance_mm = pattern_.tolerance_mm;
  request.tolerance_rad = pattern_.tolerance_rad;
  return fit_run(request);
}

void Compressor::hand_on_front(const RunFit& fit, size_t count) {
  const int spans = fit.spline.span_count();
  if (spans < 2 * kOverlap) {  // too few to be sure of any: take more moves
    window_ = std::min(kWindowMax, 2 * count);
    return;
  }
  hand_on(items_of(fit, 0, spans - kOverlap), true);
  way_out_ = items_of(fit, spans - kOverlap, spans);
  way_out_end_ = count;
  freeze(fit, spans - kOverlap);
  window_ = moves_.size() + kWindow;
}

// No curve fits the first `count` moves: what was fitted before is handed on to its end, or a shorter part is
// tried.
void Compressor::give_up(size_t count, size_t worst_vertex) {
  if (head_) {
    hand_on(way_out_, false);
    way_out_.clear();
    head_.reset();
    drop_front(way_out_end_);
    window_ = kWindow;
    return;
  }
  const size_t part = std::clamp<size_t>(worst_vertex, 1, count - 1);
  if (part < kRunMin) return hand_on_lines(part);
  window_ = part;
  cut_at_window_ = true;
}

void Compressor::hand_on_lines(size_t count) {
  for (size_t i = 0; i < count; ++i) {
    PathItem item = pattern_;
    item.feed = moves_[i].feed;
    item.line = item.last_line = moves_[i].line;
    if (i == 0 && lead_)
      item.piece = lead_->piece;
    else
      item.piece = make_line(origin_ + vertices_[i].y, origin_ + vertices_[i + 1].y);
    pass(item);
  }
  lead_.reset();
  drop_front(count);
  window_ = std::min(kWindow, std::max<size_t>(2 * window_, 16));
  cut_at_window_ = false;
}

// The run's first chord has become a part of the curve: the line before it ends where the curve starts.
void Compressor::hand_on_lead() {
  if (!lead_) return;
  PathItem line = part_of(*lead_, 0, lead_->piece.length - kLineTail);
  line.joins_next = true;
  pass(line);
  lead_.reset();
}

std::vector<PathItem> Compressor::items_of(const RunFit& fit, int from, int to) const {
  std::vector<PathItem> items;
  PathPoint start = fit.spline.derivatives_at_break(from);
  start.y += origin_;
  for (int k = from; k < to; ++k) {
    PathPoint end = fit.spline.derivatives_at_break(k + 1);
    end.y += origin_;
    const double u0 = fit.spline.at_break(k);
    append_parts(make_hermite(start, end, fit.spline.at_break(k + 1) - u0), u0,
                 fit.usage[static_cast<size_t>(k)].worst(), items);
    start = end;
  }
  return items;
}

size_t Compressor::move_at(double u) const {
  const auto after = std::upper_bound(vertices_.begin() + 1, vertices_.end() - 1, u,
                                      [](double at, const RunVertex& v) { return at < v.u; });
  return static_cast<size_t>(after - vertices_.begin()) - 1;
}

// One span of the curve, cut where the programmed feed changes.
void Compressor::append_parts(const PathPiece& piece, double u0, double usage,
                              std::vector<PathItem>& out) const {
  const double shortest = kShortestPart * piece.length;
  PathItem item = pattern_;
  item.tolerance_mm *= kToleranceKept * (1 - std::min(usage, 1.0));
  item.tolerance_rad *= kToleranceKept * (1 - std::min(usage, 1.0));
  size_t i = move_at(u0 + shortest);
  item.line = moves_[move_at(u0)].line;
  for (double from = 0; from < piece.length;) {
    item.feed = moves_[i].feed;
    double to = vertices_[++i].u - u0;
    while (to < piece.length - shortest && (alike(item.feed, moves_[i].feed) || to - from < shortest)) {
      item.feed = lower(item.feed, moves_[i].feed);
      to = vertices_[++i].u - u0;
    }
    if (to > piece.length - shortest) to = piece.length;
    item.last_line = moves_[i - 1].line;
    item.piece = from == 0 && to == piece.length ? piece : cut(piece, from, to);
    out.push_back(item);
    item.line = moves_[std::min(i, moves_.size() - 1)].line;
    from = to;
  }
}

void Compressor::hand_on(const std::vector<PathItem>& items, bool joins_next) {
  for (size_t i = 0; i < items.size(); ++i) {
    PathItem item = items[i];
    item.joins_next = joins_next || i + 1 < items.size();
    pass(item);
  }
}

void Compressor::pass(const PathItem& item) {
  next_.add(item);
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
  way_out_end_ -= passed;
  for (double& knot : head_->knots) knot -= start;  // u stays small, however long the run
  for (RunVertex& v : vertices_) v.u -= start;
}

void Compressor::drop_front(size_t count) {
  vertices_.erase(vertices_.begin(), vertices_.begin() + static_cast<std::ptrdiff_t>(count));
  moves_.erase(moves_.begin(), moves_.begin() + static_cast<std::ptrdiff_t>(count));
}

}  // namespace trn
