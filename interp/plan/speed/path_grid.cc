#include "interp/plan/speed/path_grid.h"

#include <algorithm>
#include <cmath>

#include "interp/plan/speed/time_law.h"

namespace trn::speed {

namespace {

using Place = PendingPiece::Place;

constexpr double kVariationPerInterval = 0.08;  // of a joint's jerk, over its limit
constexpr double kOfThird = 0.3;                // share of what d3 alone changes it by: it goes with d2
constexpr double kOwnInterval =
    0.5;                          // of the intervals that its variation asks for: worth one for a short piece
constexpr double kClosest = 40;   // nodes in a spacing, at most
constexpr double kGrading = 0.5;  // growth of the spacing per time, away from a closer one
constexpr int kIntervalsPerStretchMin = 32;
constexpr double kLargePart = 0.12;  // of a polynomial, in one interval: its third derivative is no parabola
constexpr double kTold = 1e-3;       // of a limit: how well parabolas must tell what lies between samples
constexpr double kFasterThanEstimate = 2;  // the true (ds/dt)^2 against the estimated
constexpr int kHalvingsMax = 3;
constexpr size_t kSpareMax = 1024;             // intervals, and pieces, whose storage is kept
constexpr int kBentParts = 8, kCalmParts = 4;  // of a polynomial between its coarse places
constexpr double kCalm = 5e-4;  // of a limit: how well parabolas must tell the joints of a calm one
constexpr double kTiny = 0.2;   // of the wanted spacing
constexpr double kRise = 2;     // of (ds/dt)^2 between two places, from which on the slower one is slow
constexpr double kClimb = 0.5;  // longest interval over its end's climb
constexpr double kNoClimb = 1e30;
// Of a piece at one feed, in spacings: so far from its ends the spacing begins to grow, and so far it may
// grow.
constexpr double kEvenFrom = 50, kEvenMost = 1e6;
constexpr int kCoarseMax = 1000;          // places of a piece
constexpr double kRoundingCubed = 2e-11;  // of jerk times time^3: see shortest_time
// Shorter climbs are not resolved, of the path so far: rounding.
constexpr double kClimbLeast = 1e-7, kClimbRounding = 1e-10;

// Time to cover h from v and a with jerk growing the acceleration: h = v t + a t^2 / 2 + j t^3 / 6.
double ramp_time(double h, double v, double a, double jerk) {
  const double even = v > 0 ? h / v : 1e30;  // never too short, nor is that from rest
  const bool rolls = even * even * even * jerk < 6 * h;
  double t = rolls ? even : std::cbrt(6 * h / jerk);
  for (int i = 0; i < (rolls ? 2 : 4); ++i) {
    const double error = t * (v + t * (a / 2 + t * jerk / 6)) - h, slope = v + t * (a + t * jerk / 2);
    if (slope > 0) t -= error / slope;
  }
  return t;
}

double travel_time(double h, double b0, double b1) { return 2 * h / (std::sqrt(b0) + std::sqrt(b1) + 1e-30); }

double place_time(const std::vector<Place>& places, size_t i) {
  return travel_time(places[i + 1].s - places[i].s, places[i].b_est, places[i + 1].b_est);
}

double piece_time(const PendingPiece& pending) {
  double sum = 0;
  for (size_t i = 0; i + 1 < pending.places.size(); ++i) sum += place_time(pending.places, i);
  return sum;
}

// Largest change of a joint's value between two samples, over the joint's limit.
double change(const PerJoint& a, const PerJoint& b, const PerJoint& limit, int count) {
  double worst = 0;
  for (size_t i = 0; i < static_cast<size_t>(count); ++i)
    worst = std::max(worst, std::abs(b[i] - a[i]) / limit[i]);
  return worst;
}

// Largest difference of a joint's acceleration or jerk at (ds/dt)^2 = b by two samples, over its limit.
double difference(const PathSample& p, const PathSample& q, double b, const JointRates& rates) {
  return std::max(b * change(p.d2, q.d2, rates.acceleration, rates.count),
                  b * std::sqrt(b) * change(p.d3, q.d3, rates.jerk, rates.count));
}

// Spacing next to a standstill that resolves the jerk-limited ramp to the speed bound.
NodeSpacing rest_spacing(const LocalBound& bound) {
  const double half_ramp_s = std::sqrt(std::sqrt(bound.b) / bound.jerk);
  return {half_ramp_s / 16, 2 * half_ramp_s};
}

// Spacing at a time away from nodes that are closer.
double near(NodeSpacing n, double t) { return n.spacing_s + kGrading * std::max(0.0, t - n.plateau_s); }

// The climb between two neighbouring places.
double climb_at(const Place& p, const Place& q, double s) {
  return std::min(p.climb + s - p.s, q.climb + q.s - s);
}

double climb_at(const PendingPiece& pending, double s) {
  const auto& places = pending.places;
  size_t i = 0;
  while (i + 2 < places.size() && s > places[i + 1].s) ++i;
  return climb_at(places[i], places[i + 1], s);
}

// The estimate is coarse next to a slow place. There (ds/dt)^2 is at most (3/2 jerk climb^2)^(2/3), which
// grows as P8 of docs/planner.md says.
void slow_down(GridInterval& g, double climb) {
  const double v_cubed = 1.5 * g.bound.jerk * climb * climb, b = std::cbrt(v_cubed * v_cubed);
  if (b >= g.b_est) return;
  g.b_est = b;
  g.time_est_s = g.h / std::sqrt(b);
}

// Path to an interval's end so that it is no longer than its share of the climb (P8) at either end.
double climb_step(const PendingPiece& pending, double s) {
  const double h = kClimb * climb_at(pending, s);
  return std::max(h / (1 + kClimb), std::min(h, kClimb * climb_at(pending, s + h)));
}

// An interval's time below which the rounding of the path behind it shows in the jerk.
double shortest_time(const PendingPiece& pending) {
  return std::cbrt(kRoundingCubed * pending.places.back().s / pending.places.front().bound.jerk);
}

LocalBound least(const LocalBound& a, const LocalBound& b) {
  return {std::min(a.b, b.b), std::min(a.acceleration, b.acceleration), std::min(a.jerk, b.jerk)};
}

}  // namespace

PathGrid::PathGrid(const PathSampler& sampler, double spacing_s, double lookahead_s)
    : sampler_(sampler), spacing_s_(spacing_s), lookahead_s_(lookahead_s) {}

void PathGrid::begin_stretch() {
  pending_.clear();
  intervals_.clear();
  s_end_ = pending_time_s_ = 0;
  before_ = {};
  spacing_before_ = {};
  climb_before_ = kNoClimb;
  merge_open_ = false;
}

// Coarse places: one each three spacings, more on a polynomial, unless it is calm, so that no wave of it
// hides between them; finer towards a rest.
static void coarse_positions(const PlanPiece& piece, double time_s, double spacing_s, bool calm, bool starts,
                             double rest_length, std::vector<double>& at) {
  const double length = piece.piece.length;
  int n = std::max(2, static_cast<int>(std::ceil(std::min<double>(kCoarseMax, time_s / (3 * spacing_s)))));
  if (piece.piece.kind == PathPiece::Kind::kPolynomial)
    n = std::max(n, time_s > spacing_s / 4    ? (calm ? kCalmParts : kBentParts)
                    : time_s > spacing_s / 10 ? 5
                                              : 3);
  at.clear();
  for (int i = 0; i <= n; ++i) at.push_back(length * i / n);
  const double graded = std::min(length / 2, rest_length);
  for (int i = 1; i < 8; ++i) {
    const double d = graded * (i * i * i / 512.0);
    if (starts) at.push_back(d);
    if (piece.ends_stretch) at.push_back(length - d);
  }
  std::sort(at.begin(), at.end());
  const auto close = [&](double a, double b) { return b - a < 1e-6 * length; };
  at.erase(std::unique(at.begin(), at.end(), close), at.end());
  at.back() = length;
}

void PathGrid::add(const PlanPiece& piece, JointCurve& curve) {
  const double length = piece.piece.length;
  std::unique_ptr<PendingPiece> taken = fresh_piece(piece, curve);
  PendingPiece& pending = *taken;
  const PathSample first = sampler_.sample(piece, pending.curve, 0, s_end_, length / 2);
  const LocalBound mid = sampler_.bound(sampler_.sample(piece, pending.curve, length / 2, s_end_, 0));
  LocalBound bound_before = sampler_.bound(first);
  const double b_most = std::max(mid.b, bound_before.b), time_s = length / std::sqrt(b_most);
  const double ramp = std::min(mid.acceleration / mid.jerk, 16 * spacing_s_);
  const bool calm =
      sampler_.parabolas_tell(piece, pending.curve, 0, length, length / kCalmParts, b_most, kCalm);
  std::vector<double>& at = scratch_;
  coarse_positions(piece, time_s, spacing_s_, calm, s_end_ == 0, mid.jerk * ramp * ramp * ramp, at);
  const JointRates& rates = sampler_.rates();
  PathSample before = first;
  for (size_t i = 0; i < at.size(); ++i) {
    const double reach = i + 1 < at.size() ? at[i + 1] - at[i] : 0;
    const PathSample sample =
        i == 0 ? first : sampler_.sample(piece, pending.curve, at[i], s_end_ + at[i], reach);
    const LocalBound bound = i == 0 ? bound_before : sampler_.bound(sample);
    pending.variation2 += 3 * std::min(bound.acceleration, bound_before.acceleration) *
                          change(before.d2, sample.d2, rates.jerk, rates.count);
    pending.variation3 += change(before.d3, sample.d3, rates.jerk, rates.count);
    pending.places.push_back({sample.s, bound, 0, 0, kNoClimb});
    pending.samples.push_back(sample);
    before = sample;
    bound_before = bound;
  }
  for (Place& place : pending.places) place.b_est = place.bound.b;
  pending_time_s_ += piece_time(pending);
  s_end_ += length;
  pending_.push_back(std::move(taken));
}

// Forward pass: from place to place with jerk and acceleration limited, under the local bounds. `flip`:
// backwards.
void PathGrid::sweep(std::vector<Place*>& all, SpeedState from, bool flip) {
  double v = std::sqrt(from.b), a = from.a;
  for (size_t i = 0; i < all.size(); ++i) {
    Place& p = *all[flip ? all.size() - 1 - i : i];
    if (i > 0) {
      const Place& before = *all[flip ? all.size() - i : i - 1];
      const double h = std::abs(p.s - before.s), v0 = v;
      const double a_max = std::min(p.bound.acceleration, before.bound.acceleration);
      const double jerk = std::min(p.bound.jerk, before.bound.jerk);
      const double t = ramp_time(h, v, a, jerk);
      const double a1 = std::min(a_max, a + jerk * t);
      v = std::sqrt(v * v + h * (std::min(a, a_max) + a1));
      const double v_max = std::sqrt(std::min(p.bound.b, p.b_est));
      a = v <= v_max ? a1 : h > 0 ? std::clamp((v_max * v_max - v0 * v0) / (2 * h), 0.0, a1) : a1;
      v = std::min(v, v_max);
    } else {
      v = std::min(v, std::sqrt(std::min(p.bound.b, p.b_est)));
    }
    p.b_est = v * v;
    p.a_est = a;
  }
}

// Profile over the pending pieces: local bounds, jerk and acceleration forwards and backwards. The unknown
// future counts as no obstacle.
void PathGrid::estimate(bool to_end) {
  std::vector<Place*> all;
  for (const auto& p : pending_)
    for (Place& place : p->places) {
      place.b_est = place.bound.b;
      all.push_back(&place);
    }
  sweep(all, before_, false);
  const SpeedState after = to_end ? SpeedState{} : SpeedState{1e12, 0};
  sweep(all, after, true);
  find_climbs(all);
  for (const auto& p : pending_) p->spacing_s = wanted_spacing(*p);
  if (pending_.front()->s == 0) grade_from(rest_spacing(pending_.front()->places.front().bound), false);
  if (to_end) grade_from(rest_spacing(pending_.back()->places.back().bound), true);
}

// The climb of all places: of the slow ones e by P8, of the others e + d by their distance from these.
void PathGrid::find_climbs(std::vector<Place*>& all) const {
  const auto own = [](const Place& p) {
    const double v = std::sqrt(p.b_est);
    return std::max({v * std::sqrt(2 * v / p.bound.jerk), kClimbLeast, kClimbRounding * p.s});
  };
  const auto much_slower = [](const Place& p, const Place& q) { return kRise * p.b_est < q.b_est; };
  all.front()->climb = climb_before_;
  for (size_t i = 1; i < all.size(); ++i) {
    const Place &before = *all[i - 1], &after = *all[std::min(i + 1, all.size() - 1)];
    Place& p = *all[i];
    const bool valley = !much_slower(before, p) && !much_slower(after, p);
    const bool slow = p.b_est > 0 && valley && (much_slower(p, before) || much_slower(p, after));
    p.climb = std::min(slow ? own(p) : kNoClimb, before.climb + p.s - before.s);
  }
  for (size_t i = all.size() - 1; i > 0; --i)
    all[i - 1]->climb = std::min(all[i - 1]->climb, all[i]->climb + all[i]->s - all[i - 1]->s);
}

// Tiny pieces next to a standstill: there, spacing grows with the distance from it. `flip`: from the end.
void PathGrid::grade_from(NodeSpacing rest, bool flip) {
  double t = 0;
  for (size_t i = 0; i < pending_.size() && near(rest, t) < spacing_s_; ++i) {
    PendingPiece& p = *pending_[flip ? pending_.size() - 1 - i : i];
    const double time_s = piece_time(p);
    if (time_s < spacing_s_) p.spacing_s = std::min(p.spacing_s, near(rest, t));
    t += time_s;
  }
}

// Time between nodes that the piece's own curvature asks for. With s's third derivative constant on an
// interval a joint's jerk (P6), q' s''' + 3 q'' s'' s' + q''' s'^3, changes along it and keeps to its limit
// at one end only: what it falls short by costs time and, where two ways to go take nearly the same, decides
// between them.
double PathGrid::wanted_spacing(PendingPiece& pending) const {
  const double time_s = piece_time(pending), calm = time_s / spacing_s_;
  const double v = pending.plan.piece.length / time_s, b = v * v;
  const double variation = (pending.variation2 + kOfThird * pending.variation3 * b) * v;
  const double bent = variation / kVariationPerInterval;
  pending.spacing_most_s = time_s / std::max(1.0, bent);
  if (calm < 0.5 && bent < kOwnInterval) return spacing_s_;
  return time_s / std::max({1.0, calm, std::min({bent, 24 + calm, kClosest * calm})});
}

double PathGrid::pending_time() const {
  double sum = 0;
  for (const auto& p : pending_) sum += piece_time(*p);
  return sum;
}

bool PathGrid::lay(bool to_end, bool force) {
  if (pending_.empty() || (!to_end && !force && pending_time_s_ < 2 * lookahead_s_)) return false;
  estimate(to_end);
  double time_s = pending_time();
  const bool whole = to_end && intervals_.empty();  // a stretch short enough to be seen at once
  const double spacing_s = whole ? std::min(spacing_s_, time_s / kIntervalsPerStretchMin) : spacing_s_;
  const size_t keep = pending_.size() / 2;
  merge_open_ = false;  // what was laid before may be planned by now
  const auto goes_on = [&] {
    return to_end || time_s > lookahead_s_ || (force && pending_.size() > keep) || merge_open_;
  };
  while (!pending_.empty() && goes_on()) {
    const PendingPiece& front = *pending_.front();
    time_s -= piece_time(front);
    before_ = {front.places.back().b_est, front.places.back().a_est};
    climb_before_ = front.places.back().climb;
    const bool last = pending_.size() == 1;
    NodeSpacing after{last ? spacing_s : pending_[1]->spacing_s, 0};
    if (last && to_end) after = rest_spacing(front.places.back().bound);
    if (front.s == 0) spacing_before_ = rest_spacing(front.places.front().bound);
    lay_piece(front, spacing_s, after, to_end && last);
    if (spare_pieces_.size() < kSpareMax) spare_pieces_.push_back(std::move(pending_.front()));
    pending_.pop_front();
  }
  pending_time_s_ = time_s;
  return true;
}

// Where the piece is after a time of its estimated motion; constant acceleration between its places.
static double place_after(const PendingPiece& pending, double t) {
  size_t i = 0;
  while (i + 2 < pending.places.size() && t > place_time(pending.places, i))
    t -= place_time(pending.places, i++);
  const Place &p = pending.places[i], &q = pending.places[i + 1];
  t = std::min(t, place_time(pending.places, i));
  const double a = (q.b_est - p.b_est) / (2 * (q.s - p.s));
  return std::clamp(p.s + t * (std::sqrt(p.b_est) + a * t / 2), p.s, q.s);
}

// The time at which it is there.
static double time_before(const PendingPiece& pending, double s) {
  s = std::min(s, pending.places.back().s);
  double t = 0;
  size_t i = 0;
  for (; i + 2 < pending.places.size() && s > pending.places[i + 1].s; ++i)
    t += place_time(pending.places, i);
  const Place &p = pending.places[i], &q = pending.places[i + 1];
  const double b = p.b_est + (q.b_est - p.b_est) * (s - p.s) / (q.s - p.s);
  return t + travel_time(s - p.s, p.b_est, b);
}

// Somewhere in the piece a slow place asks for shorter intervals than `spacing_s` does.
static bool is_climbing(const PendingPiece& pending, double spacing_s) {
  double climb = kNoClimb, b = 0;
  for (const Place& place : pending.places) {
    climb = std::min(climb, place.climb);
    b = std::max(b, place.b_est);
  }
  return kClimb * climb < spacing_s * std::sqrt(b);
}

// Time to the next node that slow places leave. What is left of the piece is not cut into a long and a short
// interval; where it is short itself, the time goes beyond it, and the nodes before are spread.
static double climb_time(const PendingPiece& pending, double t) {
  const double s = place_after(pending, t), left = pending.places.back().s - s;
  const double h = climb_step(pending, s);
  if (1.5 * h < left) return time_before(pending, s + h) - t;
  return (piece_time(pending) - t) * std::clamp(0.5 * h / std::max(left, 1e-300), 1.0, 1e6);
}

// The same bound on speed all along, as where the programmed feed decides.
static bool is_even(const PendingPiece& pending) {
  const double b = pending.places.front().bound.b;
  return std::all_of(pending.places.begin(), pending.places.end(),
                     [&](const Place& place) { return std::abs(place.bound.b - b) <= 1e-9 * b; });
}

// Moments of the nodes inside a piece: `spacing_s` apart, closer towards neighbours whose nodes are closer,
// and towards slow places; farther far from the ends of a piece at one feed, which may take hours.
static void node_times(const PendingPiece& pending, double spacing_s, NodeSpacing before, NodeSpacing after,
                       std::vector<double>& times) {
  const double time_s = piece_time(pending);
  const bool climbing = is_climbing(pending, spacing_s);
  const double shortest_s = shortest_time(pending);
  const bool long_even = time_s > 2 * kEvenFrom * spacing_s && is_even(pending);
  const double most_s = std::max(spacing_s, std::min(kEvenMost * spacing_s, pending.spacing_most_s));
  times.assign(1, 0);
  while (times.back() < time_s * (1 - 1e-9)) {
    const double t = times.back();
    const NodeSpacing even{spacing_s, kEvenFrom * spacing_s};
    const double largest_s = long_even ? std::min(most_s, near(even, std::min(t, time_s - t))) : spacing_s;
    double step = std::min(largest_s, near(before, t));
    step = std::min(step, near(after, std::max(0.0, time_s - t)) / (1 + kGrading));
    step = std::max(step, shortest_s);
    if (climbing) step = std::min(step, climb_time(pending, t));
    times.push_back(t + step);
  }
  const double excess = times.back() / time_s;  // spread, rather than leaving a short last one
  for (double& t : times) t /= excess;
}

PathGrid::IntervalSize PathGrid::wanted_size(const PendingPiece& pending, double spacing_s) {
  double climb = kNoClimb;
  for (const Place& place : pending.places) climb = std::min(climb, place.climb);
  const double v_mean = pending.plan.piece.length / piece_time(pending);
  const double length = std::max(kClimb * climb, v_mean * shortest_time(pending));
  if (length >= v_mean * spacing_s) return {spacing_s, 0};
  return {length / v_mean, length};
}

// Of the size wanted, the share that the last interval has.
double PathGrid::filled(const IntervalSize& wanted) const {
  const GridInterval& g = intervals_.back();
  return wanted.length > 0 ? g.h / wanted.length : g.time_est_s / wanted.time_s;
}

// A tiny piece is merged with its neighbours into one interval; any other gets borders of its own.
void PathGrid::lay_piece(const PendingPiece& pending, double spacing_s, NodeSpacing after, bool last) {
  const double time_s = piece_time(pending);
  const double wanted_s = std::max(std::min(spacing_s, pending.spacing_s), shortest_time(pending));
  const IntervalSize size = wanted_size(pending, wanted_s);
  if (time_s < 0.5 * size.time_s && !(last && !merge_open_)) {
    put_short(pending, time_s);
    if (filled(size) >= 0.75) merge_open_ = false;
    if (filled(size) >= kTiny) spacing_before_ = {intervals_.back().time_est_s, 0};
    return;
  }
  // Between longer ones a tiny one gets no interval of its own: there, what is off by rounding would have to
  // be made good within microseconds.
  bool merge = merge_open_ && filled(size) < kTiny;
  merge_open_ = false;
  std::vector<double>& times = scratch_;
  node_times(pending, wanted_s * (1 + 1e-9), spacing_before_, after, times);
  const double shortest = std::min(1e-7 * pending.plan.piece.length, 0.1 * kClimb * kClimbLeast);
  const double s_end = pending.s + pending.plan.piece.length;
  double s0 = pending.s, t0 = 0;
  for (size_t i = 1; i < times.size(); ++i) {
    const bool at_end = i + 1 == times.size();
    const double s1 = at_end ? s_end : place_after(pending, times[i]);
    if (!at_end && (s1 - s0 < shortest || s1 >= s_end)) continue;
    append_interval(pending, s0, s1, times[i] - t0, merge);
    merge = false;
    s0 = s1;
    t0 = times[i];
  }
  spacing_before_ = {intervals_.back().time_est_s, 0};
}

void PathGrid::drop_front(size_t count) {
  for (size_t i = 0; i < count && spare_.size() < kSpareMax; ++i) spare_.push_back(std::move(intervals_[i]));
  intervals_.erase(intervals_.begin(), intervals_.begin() + static_cast<std::ptrdiff_t>(count));
}

std::unique_ptr<PendingPiece> PathGrid::fresh_piece(const PlanPiece& piece, JointCurve& curve) {
  std::unique_ptr<PendingPiece> out;
  if (spare_pieces_.empty()) {
    out = std::make_unique<PendingPiece>();
  } else {
    out = std::move(spare_pieces_.back());
    spare_pieces_.pop_back();
  }
  out->plan = piece;
  out->curve.swap(curve);
  out->s = s_end_;
  out->spacing_s = out->variation2 = out->variation3 = 0;
  out->places.clear();
  out->samples.clear();
  return out;
}

GridInterval PathGrid::fresh_interval() {
  if (spare_.empty()) return {};
  GridInterval g = std::move(spare_.back());
  spare_.pop_back();
  g.samples.clear();
  g.judged.clear();
  return g;
}

void PathGrid::append_interval(const PendingPiece& pending, double s0, double s1, double time_s, bool merge) {
  GridInterval g = fresh_interval();
  g.s = s0;
  g.h = s1 - s0;
  g.time_est_s = time_s;
  g.b_est = (g.h / time_s) * (g.h / time_s);
  const PathPiece& piece = pending.plan.piece;
  const bool bends = piece.kind == PathPiece::Kind::kPolynomial && g.h > piece.length * kLargePart;
  const int parts = bends ? 4 : 2;
  g.samples.reserve(static_cast<size_t>(parts) + 1);
  for (int i = 0; i <= parts; ++i) {
    const double s = i == parts ? s1 : s0 + g.h * i / parts;
    const bool shared = i == 0 && s0 > pending.s && !intervals_.empty();
    g.samples.push_back(shared ? intervals_.back().samples.back()
                               : sampler_.sample(pending.plan, pending.curve, s - pending.s, s, g.h / parts));
    const LocalBound bound = sampler_.bound(g.samples.back());
    g.bound = i == 0 ? bound : least(g.bound, bound);
  }
  slow_down(g, climb_at(pending, s0 + g.h / 2));
  refine(pending, g);
  put_interval(std::move(g), merge);
}

// Halves the samples' distances until parabolas through three of them tell what lies between.
void PathGrid::refine(const PendingPiece& pending, GridInterval& g) {
  const JointRates& rates = sampler_.rates();
  const double b = std::min(g.bound.b, kFasterThanEstimate * g.b_est), s0 = g.s - pending.s;
  const double step = g.h / static_cast<double>(g.samples.size() - 1);
  if (sampler_.parabolas_tell(pending.plan, pending.curve, s0, s0 + g.h, step, b, kTold)) return;
  for (int halving = 0; halving < kHalvingsMax; ++halving) {
    finer_.clear();
    bool differs = false;
    for (size_t i = 0; i + 1 < g.samples.size(); ++i) {
      const double s = (g.samples[i].s + g.samples[i + 1].s) / 2;
      const PathSample told = between(&g.samples[i > 0 ? i - 1 : 0], s, rates.count);
      finer_.push_back(g.samples[i]);
      finer_.push_back(sampler_.sample(pending.plan, pending.curve, s - pending.s, s, s - g.samples[i].s));
      differs = differs || difference(told, finer_.back(), b, rates) > kTold;
    }
    if (!differs) return;
    finer_.push_back(g.samples.back());
    g.samples.swap(finer_);
    for (const PathSample& sample : g.samples) g.bound = least(g.bound, sampler_.bound(sample));
  }
}

// One interval more, or, merged, the last one longer by it.
void PathGrid::put_interval(GridInterval&& by, bool merge) {
  if (!merge) {
    intervals_.push_back(std::move(by));
    return;
  }
  GridInterval& g = intervals_.back();
  g.bound = least(g.bound, by.bound);
  g.samples.insert(g.samples.end(), by.samples.begin(), by.samples.end());
  g.judged.clear();
  g.h += by.h;
  g.time_est_s += by.time_est_s;
  g.b_est = (g.h / g.time_est_s) * (g.h / g.time_est_s);
}

// A piece too short for an interval of its own.
void PathGrid::put_short(const PendingPiece& pending, double time_s) {
  GridInterval g = fresh_interval();
  g.s = pending.s;
  g.h = pending.plan.piece.length;
  g.time_est_s = time_s;
  g.b_est = (g.h / time_s) * (g.h / time_s);
  g.bound = pending.places.front().bound;
  for (const Place& place : pending.places) g.bound = least(g.bound, place.bound);
  g.samples = pending.samples;
  slow_down(g, climb_at(pending, g.s + g.h / 2));
  put_interval(std::move(g), merge_open_);
  merge_open_ = true;
}

}  // namespace trn::speed
