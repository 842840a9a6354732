#include "interp/plan/speed/path_grid.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/path.h"
#include "interp/plan/speed/joint_rates.h"

namespace trn::speed {

namespace {

using ProfilePoint = PendingPiece::ProfilePoint;

// Nodes by the change of a joint's jerk (see wanted_spacing).
constexpr double kVariationPerInterval = 0.08;  // change of a joint's jerk along an interval, over its limit
constexpr double kOfThird = 0.3;  // weight of the change of q''' alone, which mostly goes with that of q''
constexpr double kOwnInterval = 0.5;  // intervals asked for by that change, from which a short piece gets one
constexpr double kClosest = 40;       // nodes in a nominal spacing, at most
constexpr double kGrading = 0.5;      // growth of the spacing per time, away from nodes that are closer
constexpr int kIntervalsPerStretchMin = 32;

// Samples.
constexpr double kLargePart = 0.12;         // of a polynomial in one interval, which then gets more samples
constexpr double kParabolaAccuracy = 1e-3;  // of a limit: error between samples, interpolated by parabolas
constexpr double kFasterThanEstimate = 2;   // (ds/dt)^2 possible over the estimated one
constexpr int kHalvingsMax = 3;
constexpr int kCurvedParts = 8, kSmoothParts = 4;  // of a polynomial between points of its profile
constexpr double kSmoothAccuracy = 5e-4;           // of a limit: error of parabolas along a smooth polynomial
constexpr int kProfileMax = 1000;                  // points in the profile of a piece

// Ramps (P8).
constexpr double kRise = 2;         // of (ds/dt)^2 from a slow point to its neighbour
constexpr double kRampShare = 0.5;  // longest interval over the ramp at its ends
constexpr double kNoRamp = 1e30;
constexpr double kRampLeast = 1e-7;      // shorter ramps are not resolved,
constexpr double kRampRounding = 1e-10;  // nor those below this share of the path so far: rounding

// A piece at one feed, in spacings: the spacing begins to grow so far from its ends, and may grow so much.
constexpr double kConstantFrom = 50, kConstantMost = 1e6;

constexpr double kTiny = 0.2;             // of the wanted spacing: no interval of its own
constexpr double kRoundingCubed = 2e-11;  // of jerk times time^3: see shortest_time
constexpr size_t kSpareMax = 1024;        // intervals, and pieces, whose storage is kept

// Time to cover h from v and a at constant jerk: h = v t + a t^2 / 2 + jerk t^3 / 6, by Newton's method. It
// starts from the time at constant speed or the one from rest, whichever is less. Both are too long, and the
// cubic is convex, so the iteration stays on that side.
double ramp_time(double h, double v, double a, double jerk) {
  const double even = v > 0 ? h / v : 1e30;
  const bool moving = even * even * even * jerk < 6 * h;
  double t = moving ? even : std::cbrt(6 * h / jerk);
  for (int i = 0; i < (moving ? 2 : 4); ++i) {
    const double error = t * (v + t * (a / 2 + t * jerk / 6)) - h, slope = v + t * (a + t * jerk / 2);
    if (slope > 0) t -= error / slope;
  }
  return t;
}

double travel_time(double h, double b0, double b1) { return 2 * h / (std::sqrt(b0) + std::sqrt(b1) + 1e-30); }

double profile_time(const std::vector<ProfilePoint>& profile, size_t i) {
  return travel_time(profile[i + 1].s - profile[i].s, profile[i].b_est, profile[i + 1].b_est);
}

double piece_time(const PendingPiece& pending) {
  double sum = 0;
  for (size_t i = 0; i + 1 < pending.profile.size(); ++i) sum += profile_time(pending.profile, i);
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

// Spacing at a time `t` away from nodes that are closer.
double spacing_at(NodeSpacing n, double t) { return n.spacing_s + kGrading * std::max(0.0, t - n.plateau_s); }

// The ramp between two neighbouring points of the profile.
double ramp_at(const ProfilePoint& p, const ProfilePoint& q, double s) {
  return std::min(p.ramp + s - p.s, q.ramp + q.s - s);
}

double ramp_at(const PendingPiece& pending, double s) {
  const auto& profile = pending.profile;
  size_t i = 0;
  while (i + 2 < profile.size() && s > profile[i + 1].s) ++i;
  return ramp_at(profile[i], profile[i + 1], s);
}

// The estimated profile is coarse next to a slow point, and too fast between its points. On the ramp
// (ds/dt)^2 is at most (3/2 jerk ramp^2)^(2/3): from rest, s = jerk t^3 / 6 and ds/dt = jerk t^2 / 2 (P8 of
// docs/planner.md).
void slow_down(GridInterval& g, double ramp) {
  const double v_cubed = 1.5 * g.bound.jerk * ramp * ramp, b = std::cbrt(v_cubed * v_cubed);
  if (b >= g.b_est) return;
  g.b_est = b;
  g.time_est_s = g.h / std::sqrt(b);
}

// Length of the interval that begins at s: at most its share of the ramp (P8) at either end. Where the ramp
// falls along the interval, by no more than the interval's length, h / (1 + share) keeps the bound in any
// case.
double ramp_step(const PendingPiece& pending, double s) {
  const double h = kRampShare * ramp_at(pending, s);
  return std::max(h / (1 + kRampShare), std::min(h, kRampShare * ramp_at(pending, s + h)));
}

// The shortest useful time of an interval. The path behind it is rounded by a share of its length; divided by
// the cube of the time that is a jerk, which must stay small against what the joints allow.
double shortest_time(const PendingPiece& pending) {
  return std::cbrt(kRoundingCubed * pending.profile.back().s / pending.profile.front().bound.jerk);
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
  lay_from_s_ = 2 * lookahead_s_;
  before_ = {};
  spacing_before_ = {};
  ramp_before_ = kNoRamp;
  merge_open_ = false;
}

// Points of a piece's profile: one every three spacings; more on a polynomial unless it is smooth, so that no
// wave of it hides between them; and graded towards a standstill by the cube of an even division, as s grows
// with time there.
static void coarse_positions(const PlanPiece& piece, double time_s, double spacing_s, bool smooth,
                             bool starts, double rest_length, std::vector<double>& at) {
  const double length = piece.piece.length;
  int n = std::max(2, static_cast<int>(std::ceil(std::min<double>(kProfileMax, time_s / (3 * spacing_s)))));
  if (piece.piece.kind == PathPiece::Kind::kPolynomial)
    n = std::max(n, time_s > spacing_s / 4    ? (smooth ? kSmoothParts : kCurvedParts)
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
  const double ramp_s = std::min(mid.acceleration / mid.jerk, 16 * spacing_s_);
  const bool smooth = sampler_.parabolas_predict(piece, pending.curve, 0, length, length / kSmoothParts,
                                                 b_most, kSmoothAccuracy);
  std::vector<double>& at = scratch_;
  coarse_positions(piece, time_s, spacing_s_, smooth, s_end_ == 0, mid.jerk * ramp_s * ramp_s * ramp_s, at);
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
    pending.profile.push_back({sample.s, bound, 0, 0, kNoRamp});
    pending.samples.push_back(sample);
    before = sample;
    bound_before = bound;
  }
  for (ProfilePoint& point : pending.profile) point.b_est = point.bound.b;
  pending_time_s_ += piece_time(pending);
  s_end_ += length;
  pending_.push_back(std::move(taken));
}

// One of the two passes of the estimate: from point to point along the path, or backwards, with acceleration
// and its growth limited, under the local bounds and under what the other pass left. The fall of the
// acceleration at the end of a ramp is not limited, so the estimate is a little fast. It only places nodes
// and starts the solver.
void PathGrid::sweep(std::vector<ProfilePoint*>& all, SpeedState from, bool backwards) {
  double v = std::sqrt(from.b), a = from.a;
  for (size_t i = 0; i < all.size(); ++i) {
    ProfilePoint& p = *all[backwards ? all.size() - 1 - i : i];
    if (i > 0) {
      const ProfilePoint& before = *all[backwards ? all.size() - i : i - 1];
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

// Speed profile of the pending pieces: the least of the local bounds and of what can be reached forwards and
// backwards. The unknown future counts as no obstacle.
void PathGrid::estimate(bool to_end) {
  std::vector<ProfilePoint*> all;
  for (const auto& p : pending_)
    for (ProfilePoint& point : p->profile) {
      point.b_est = point.bound.b;
      all.push_back(&point);
    }
  sweep(all, before_, false);
  const SpeedState after = to_end ? SpeedState{} : SpeedState{1e12, 0};
  sweep(all, after, true);
  find_ramps(all);
  for (const auto& p : pending_) p->spacing_s = wanted_spacing(*p);
  if (pending_.front()->s == 0) grade_from(rest_spacing(pending_.front()->profile.front().bound), false);
  if (to_end) grade_from(rest_spacing(pending_.back()->profile.back().bound), true);
}

// The ramp at every point of the profile: e of P8 at a slow point, which is a valley and much slower than one
// of its neighbours; elsewhere e + d, the least over all slow points at their distances d, found by a sweep
// each way.
void PathGrid::find_ramps(std::vector<ProfilePoint*>& all) const {
  const auto own = [](const ProfilePoint& p) {
    const double v = std::sqrt(p.b_est);
    return std::max({v * std::sqrt(2 * v / p.bound.jerk), kRampLeast, kRampRounding * p.s});
  };
  const auto much_slower = [](const ProfilePoint& p, const ProfilePoint& q) {
    return kRise * p.b_est < q.b_est;
  };
  all.front()->ramp = ramp_before_;
  for (size_t i = 1; i < all.size(); ++i) {
    const ProfilePoint &before = *all[i - 1], &after = *all[std::min(i + 1, all.size() - 1)];
    ProfilePoint& p = *all[i];
    const bool valley = !much_slower(before, p) && !much_slower(after, p);
    const bool slow = p.b_est > 0 && valley && (much_slower(p, before) || much_slower(p, after));
    p.ramp = std::min(slow ? own(p) : kNoRamp, before.ramp + p.s - before.s);
  }
  for (size_t i = all.size() - 1; i > 0; --i)
    all[i - 1]->ramp = std::min(all[i - 1]->ramp, all[i]->ramp + all[i]->s - all[i - 1]->s);
}

// Grades the spacing of tiny pieces next to a standstill: it grows with the time from there. Longer pieces
// are graded inside, by node_times. `backwards`: from the end.
void PathGrid::grade_from(NodeSpacing rest, bool backwards) {
  double t = 0;
  for (size_t i = 0; i < pending_.size() && spacing_at(rest, t) < spacing_s_; ++i) {
    PendingPiece& p = *pending_[backwards ? pending_.size() - 1 - i : i];
    const double time_s = piece_time(p);
    if (time_s < spacing_s_) p.spacing_s = std::min(p.spacing_s, spacing_at(rest, t));
    t += time_s;
  }
}

// Time between nodes that the piece's own curvature asks for. On an interval d3s/dt3 is constant, but a
// joint's jerk (P6), q' s''' + 3 q'' s'' s' + q''' s'^3, changes. It reaches its limit at one end only and
// falls short inside, which costs a little time. Where two courses of the speed take nearly the same time, it
// also decides between them, by where the nodes happen to lie. So its change along an interval is bounded.
double PathGrid::wanted_spacing(PendingPiece& pending) const {
  const double time_s = piece_time(pending), nominal = time_s / spacing_s_;
  const double v = pending.plan.piece.length / time_s, b = v * v;
  const double variation = (pending.variation2 + kOfThird * pending.variation3 * b) * v;
  const double by_variation = variation / kVariationPerInterval;
  pending.spacing_most_s = time_s / std::max(1.0, by_variation);
  if (nominal < 0.5 && by_variation < kOwnInterval) return spacing_s_;
  return time_s / std::max({1.0, nominal, std::min({by_variation, 24 + nominal, kClosest * nominal})});
}

double PathGrid::pending_time() const {
  double sum = 0;
  for (const auto& p : pending_) sum += piece_time(*p);
  return sum;
}

// At the far end of what is known the estimate is wrong, since slow places may follow. So a piece gets its
// grid only when `lookahead_s_` of motion is known behind its end; how long the piece itself is does not help
// it. The estimate at the end of the last piece laid is where the next one starts.
bool PathGrid::lay(bool to_end, bool force) {
  if (pending_.empty() || (!to_end && !force && pending_time_s_ < lay_from_s_)) return false;
  estimate(to_end);
  double time_s = pending_time();
  const bool whole = to_end && intervals_.empty();  // a stretch short enough to be seen at once
  const double spacing_s = whole ? std::min(spacing_s_, time_s / kIntervalsPerStretchMin) : spacing_s_;
  const size_t before = pending_.size(), keep = before / 2;
  merge_open_ = false;  // what was laid before may be planned by now
  const auto known_behind = [&] { return time_s - piece_time(*pending_.front()); };
  const auto goes_on = [&] {
    return to_end || known_behind() > lookahead_s_ || (force && pending_.size() > keep) || merge_open_;
  };
  while (!pending_.empty() && goes_on()) {
    const PendingPiece& front = *pending_.front();
    time_s -= piece_time(front);
    before_ = {front.profile.back().b_est, front.profile.back().a_est};
    ramp_before_ = front.profile.back().ramp;
    const bool last = pending_.size() == 1;
    NodeSpacing after{last ? spacing_s : pending_[1]->spacing_s, 0};
    if (last && to_end) after = rest_spacing(front.profile.back().bound);
    if (front.s == 0) spacing_before_ = rest_spacing(front.profile.front().bound);
    lay_piece(front, spacing_s, after, to_end && last);
    if (spare_pieces_.size() < kSpareMax) spare_pieces_.push_back(std::move(pending_.front()));
    pending_.pop_front();
  }
  pending_time_s_ = time_s;
  lay_from_s_ = 2 * lookahead_s_ + (pending_.empty() ? 0 : piece_time(*pending_.front()));
  return pending_.size() < before;
}

// The place s in the stretch after a time t of the estimated motion along the piece; the acceleration is
// constant between points of the profile.
static double position_after(const PendingPiece& pending, double t) {
  size_t i = 0;
  while (i + 2 < pending.profile.size() && t > profile_time(pending.profile, i))
    t -= profile_time(pending.profile, i++);
  const ProfilePoint &p = pending.profile[i], &q = pending.profile[i + 1];
  t = std::min(t, profile_time(pending.profile, i));
  const double a = (q.b_est - p.b_est) / (2 * (q.s - p.s));
  return std::clamp(p.s + t * (std::sqrt(p.b_est) + a * t / 2), p.s, q.s);
}

// Its inverse: the time at which the estimated motion is at s.
static double time_until(const PendingPiece& pending, double s) {
  s = std::min(s, pending.profile.back().s);
  double t = 0;
  size_t i = 0;
  for (; i + 2 < pending.profile.size() && s > pending.profile[i + 1].s; ++i)
    t += profile_time(pending.profile, i);
  const ProfilePoint &p = pending.profile[i], &q = pending.profile[i + 1];
  const double b = p.b_est + (q.b_est - p.b_est) * (s - p.s) / (q.s - p.s);
  return t + travel_time(s - p.s, p.b_est, b);
}

// True: somewhere in the piece a ramp asks for shorter intervals than `spacing_s` does.
static bool has_ramp(const PendingPiece& pending, double spacing_s) {
  double ramp = kNoRamp, b = 0;
  for (const ProfilePoint& point : pending.profile) {
    ramp = std::min(ramp, point.ramp);
    b = std::max(b, point.b_est);
  }
  return kRampShare * ramp < spacing_s * std::sqrt(b);
}

// Time from t to the next node that the ramps allow. The step must not leave a short interval behind at the
// end of the piece: what is left there becomes one step. A step may also lead beyond the end, since
// node_times spreads the nodes over the piece afterwards.
static double ramp_step_time(const PendingPiece& pending, double t) {
  const double s = position_after(pending, t), left = pending.profile.back().s - s;
  const double h = ramp_step(pending, s);
  if (1.5 * h < left) return time_until(pending, s + h) - t;
  return (piece_time(pending) - t) * std::clamp(0.5 * h / std::max(left, 1e-300), 1.0, 1e6);
}

// True: the bound on speed is the same all along, as where the programmed feed decides.
static bool has_one_bound(const PendingPiece& pending) {
  const double b = pending.profile.front().bound.b;
  return std::all_of(pending.profile.begin(), pending.profile.end(),
                     [&](const ProfilePoint& point) { return std::abs(point.bound.b - b) <= 1e-9 * b; });
}

// Times of the nodes inside a piece: `spacing_s` apart, closer towards neighbours whose nodes are closer and
// along ramps, farther far from the ends of a piece at one feed, which may take hours. The last step leads
// beyond the end of the piece, and all times are scaled down by as much, rather than leaving a short interval
// there.
static void node_times(const PendingPiece& pending, double spacing_s, NodeSpacing before, NodeSpacing after,
                       std::vector<double>& times) {
  const double time_s = piece_time(pending);
  const bool ramps = has_ramp(pending, spacing_s);
  const double shortest_s = shortest_time(pending);
  const bool long_constant = time_s > 2 * kConstantFrom * spacing_s && has_one_bound(pending);
  const double most_s = std::max(spacing_s, std::min(kConstantMost * spacing_s, pending.spacing_most_s));
  times.assign(1, 0);
  while (times.back() < time_s * (1 - 1e-9)) {
    const double t = times.back();
    const NodeSpacing even{spacing_s, kConstantFrom * spacing_s};
    const double largest_s =
        long_constant ? std::min(most_s, spacing_at(even, std::min(t, time_s - t))) : spacing_s;
    double step = std::min(largest_s, spacing_at(before, t));
    step = std::min(step, spacing_at(after, std::max(0.0, time_s - t)) / (1 + kGrading));
    step = std::max(step, shortest_s);
    if (ramps) step = std::min(step, ramp_step_time(pending, t));
    times.push_back(t + step);
  }
  const double excess = times.back() / time_s;
  for (double& t : times) t /= excess;
}

PathGrid::IntervalSize PathGrid::wanted_size(const PendingPiece& pending, double spacing_s) {
  double ramp = kNoRamp;
  for (const ProfilePoint& point : pending.profile) ramp = std::min(ramp, point.ramp);
  const double v_mean = pending.plan.piece.length / piece_time(pending);
  const double length = std::max(kRampShare * ramp, v_mean * shortest_time(pending));
  if (length >= v_mean * spacing_s) return {spacing_s, 0};
  return {length / v_mean, length};
}

// Share of the size wanted that the last interval has.
double PathGrid::filled(const IntervalSize& wanted) const {
  const GridInterval& g = intervals_.back();
  return wanted.length > 0 ? g.h / wanted.length : g.time_est_s / wanted.time_s;
}

// Lays the grid over one piece. A short piece is merged with its neighbours into one interval. Any other has
// nodes at both borders, because only three derivatives are continuous there.
void PathGrid::lay_piece(const PendingPiece& pending, double spacing_s, NodeSpacing after, bool last) {
  const double time_s = piece_time(pending);
  const double wanted_s = std::max(std::min(spacing_s, pending.spacing_s), shortest_time(pending));
  const IntervalSize size = wanted_size(pending, wanted_s);
  if (time_s < 0.5 * size.time_s && !(last && !merge_open_)) {
    append_short(pending, time_s);
    if (filled(size) >= 0.75) merge_open_ = false;
    if (filled(size) >= kTiny) spacing_before_ = {intervals_.back().time_est_s, 0};
    return;
  }
  // A merged interval that stayed tiny between longer pieces takes in the next interval too. On its own,
  // rounding of the path would have to be corrected within microseconds.
  bool merge = merge_open_ && filled(size) < kTiny;
  merge_open_ = false;
  std::vector<double>& times = scratch_;
  node_times(pending, wanted_s * (1 + 1e-9), spacing_before_, after, times);
  const double shortest = std::min(1e-7 * pending.plan.piece.length, 0.1 * kRampShare * kRampLeast);
  const double s_end = pending.s + pending.plan.piece.length;
  double s0 = pending.s, t0 = 0;
  for (size_t i = 1; i < times.size(); ++i) {
    const bool at_end = i + 1 == times.size();
    const double s1 = at_end ? s_end : position_after(pending, times[i]);
    if (!at_end && (s1 - s0 < shortest || s1 >= s_end)) continue;
    append_interval(pending, s0, s1, times[i] - t0, merge);
    merge = false;
    s0 = s1;
    t0 = times[i];
  }
  spacing_before_ = {intervals_.back().time_est_s, 0};
}

void PathGrid::drop_front(size_t count) {
  TRN_CHECK(count <= intervals_.size());
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
  out->profile.clear();
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
  TRN_CHECK(s1 > s0);
  TRN_CHECK(time_s > 0);
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
  slow_down(g, ramp_at(pending, s0 + g.h / 2));
  refine(pending, g);
  put_interval(std::move(g), merge);
}

// Halves the distances of the samples until parabolas through three of them predict what lies between. Bounds
// of the joints' polynomials may show beforehand that they do; else each halving samples in between and
// compares.
void PathGrid::refine(const PendingPiece& pending, GridInterval& g) {
  TRN_CHECK(g.samples.size() >= 2);
  const JointRates& rates = sampler_.rates();
  const double b = std::min(g.bound.b, kFasterThanEstimate * g.b_est), s0 = g.s - pending.s;
  const double step = g.h / static_cast<double>(g.samples.size() - 1);
  if (sampler_.parabolas_predict(pending.plan, pending.curve, s0, s0 + g.h, step, b, kParabolaAccuracy))
    return;
  for (int halving = 0; halving < kHalvingsMax; ++halving) {
    finer_.clear();
    bool differs = false;
    for (size_t i = 0; i + 1 < g.samples.size(); ++i) {
      const double s = (g.samples[i].s + g.samples[i + 1].s) / 2;
      const PathSample predicted = interpolate(&g.samples[i > 0 ? i - 1 : 0], s, rates.count);
      finer_.push_back(g.samples[i]);
      finer_.push_back(sampler_.sample(pending.plan, pending.curve, s - pending.s, s, s - g.samples[i].s));
      differs = differs || difference(predicted, finer_.back(), b, rates) > kParabolaAccuracy;
    }
    if (!differs) return;
    finer_.push_back(g.samples.back());
    g.samples.swap(finer_);
    for (const PathSample& sample : g.samples) g.bound = least(g.bound, sampler_.bound(sample));
  }
}

// Appends an interval, or merges it into the last one, which is then longer by it.
void PathGrid::put_interval(GridInterval&& by, bool merge) {
  TRN_CHECK(!merge || !intervals_.empty());
  TRN_CHECK(by.h > 0 && by.samples.size() >= 2);
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

// Appends a piece that is too short for an interval of its own, with the samples of its profile. The interval
// stays open for the next piece.
void PathGrid::append_short(const PendingPiece& pending, double time_s) {
  GridInterval g = fresh_interval();
  g.s = pending.s;
  g.h = pending.plan.piece.length;
  g.time_est_s = time_s;
  g.b_est = (g.h / time_s) * (g.h / time_s);
  g.bound = pending.profile.front().bound;
  for (const ProfilePoint& point : pending.profile) g.bound = least(g.bound, point.bound);
  g.samples = pending.samples;
  slow_down(g, ramp_at(pending, g.s + g.h / 2));
  put_interval(std::move(g), merge_open_);
  merge_open_ = true;
}

}  // namespace trn::speed
