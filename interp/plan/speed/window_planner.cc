#include "interp/plan/speed/window_planner.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "interp/move.h"

namespace trn::speed {

namespace {

// Shares of the limits that the solver's rows get at first; the rest covers what lies between the rows.
constexpr Headroom kFreshHeadroom{0.9996, 0.998, 0.990, 1.6};
// Uses that verification accepts; the rest covers what lies between the places judged.
constexpr double kVelocityAccept = 0.99999, kAccelerationAccept = 0.9995, kJerkAccept = 0.998;
constexpr InteriorPointOptions kFirstSolve{200, 5e-3, 0.01}, kNextSolve{30, 5e-3, 3e-4};
constexpr double kLoweredMax = 0.7;                // in a round: a half
constexpr double kWindow = 3, kProvisional = 1.5;  // brake times planned at once, and of these left open
constexpr size_t kIntervalsMin = 8, kShortWindowMin = 40;
constexpr double kUndershoot = 0.6;   // of the dip left to an interval in which the law would turn back
constexpr int kSlowerFrom = 4;        // round from which a place that stays beyond its jerk is slowed down
constexpr double kPartsMost = 1000;   // of a piece at one feed
constexpr int kFeedSamples = 64;      // of a piece, to find out whether its feed is the same all along
constexpr double kSlowGuess = 0.3;    // of the squared speeds of the first guess
constexpr double kRestGrading = 0.6;  // longest interval over its distance from a standstill

// Time between nodes: a tenth of the shortest time in which a joint's acceleration grows to its limit.
double spacing(const Joints& joints, double wanted) {
  if (wanted > 0) return wanted;
  double ramp = 0.064;
  for (const Joint& j : joints) ramp = std::min(ramp, j.limit.acceleration / j.limit.jerk);
  return std::max(ramp / 10, 1e-4);
}

// Time in which the slowest joint stops from its greatest velocity, by its own limits.
double brake_time(const Joints& joints) {
  double t = 0;
  for (const Joint& j : joints)
    t = std::max(t, j.limit.velocity / j.limit.acceleration + j.limit.acceleration / j.limit.jerk);
  return std::min(t, 2.0);
}

SpeedOptions completed(SpeedOptions options, const Joints& joints) {
  options.node_spacing_s = spacing(joints, options.node_spacing_s);
  return options;
}

// (ds/dt)^2 at a distance from a standstill, at constant jerk: s = jerk t^3 / 6, ds/dt = jerk t^2 / 2.
double from_rest_b(double jerk, double distance) {
  const double v_cubed = 1.5 * jerk * distance * distance;
  return std::cbrt(v_cubed * v_cubed);
}

// Intervals to merge into the constant-jerk segment next to a standstill, so that the others are short
// against their distance from it. `from_end`: counted from the end of the grid.
size_t rest_intervals(const std::deque<GridInterval>& grid, bool from_end) {
  const size_t n = grid.size();
  const auto h = [&](size_t i) { return grid[from_end ? n - 1 - i : i].h; };
  size_t merged = 1;
  double distance = 0;
  for (size_t i = 0; i < std::min<size_t>(n, 60); ++i) {
    if (i > 0 && h(i) > kRestGrading * distance) merged = i + 1;
    distance += h(i);
  }
  return std::min(merged, n / 3);
}

// Lowers speeds behind the first `keep` so that neighbours differ by at most half of what the acceleration
// allows (b changes by 2 a h), by a sweep each way.
void limit_acceleration(const std::deque<GridInterval>& grid, size_t head, size_t keep, Doubles& b) {
  const size_t n = b.size();
  for (size_t k = std::max<size_t>(keep, 1); k < n; ++k)
    b[k] = std::min(b[k], b[k - 1] + grid[head + k].bound.acceleration * grid[head + k].h);
  for (size_t k = n - 1; k-- > keep;)
    b[k] = std::min(b[k], b[k + 1] + grid[head + k].bound.acceleration * grid[head + k].h);
}

// Smooths speeds behind the first `keep`: the least of each and its neighbours, then the mean of three of
// these. So the result is hardly above what it was.
void smooth_below(size_t keep, Doubles& b) {
  const size_t n = b.size();
  Doubles least = b;
  for (size_t k = keep; k < n; ++k)
    for (const size_t i : {std::max(k, keep + 1) - 1, std::min(k + 1, n - 1)})
      least[k] = std::min(least[k], b[i]);
  b = least;
  for (size_t k = keep + 1; k + 1 < n; ++k) b[k] = (least[k - 1] + least[k] + least[k + 1]) / 3;
}

}  // namespace

WindowPlanner::WindowPlanner(const Joints& joints, const JointMap& map, const SpeedOptions& options,
                             BlockSink& out)
    : options_(completed(options, joints)),
      sampler_(joints, map, joint_rates(joints, options.acceleration_share, options.jerk_share)),
      grid_(sampler_, options_.node_spacing_s, 1.5 * brake_time(joints)),
      emitter_(joint_rates(joints, 1, 1), out),
      brake_s_(brake_time(joints)) {
  TRN_CHECK(options_.rounds_max >= 1);
}

// Behind a place that cannot be planned nothing is: the verified plan is driven to its standstill, and that
// is not where a later piece would begin.
template <typename Work>
void WindowPlanner::or_end_at_rest(Work work) {
  if (failed_) return;
  try {
    work();
  } catch (const ProgramError&) {
    failed_ = true;
    emit_rest();
    throw;
  }
}

void WindowPlanner::piece(const PlanPiece& piece) {
  or_end_at_rest([&] { plan(piece); });
}

void WindowPlanner::plan(const PlanPiece& piece) {
  TRN_CHECK(piece.piece.length > 0);
  if (!open_) {
    grid_.begin_stretch();
    emitter_.begin_stretch();
    sampler_.begin(piece);
    headroom_.clear();
    law_.clear();
    c_before_.clear();
    start_ = Start{};
    retries_ = 0;
    s_next_ = 0;
    stretch_brake_s_ = brake_s_;
    open_ = true;
  }
  if (std::isfinite(piece.feed.tip_mm_s) && std::isfinite(piece.feed.tip_mm_s2))
    stretch_brake_s_ = std::max(stretch_brake_s_, brake_s_ + piece.feed.tip_mm_s / piece.feed.tip_mm_s2);
  ++stats_.pieces;
  sampler_.curve(piece, curve_);
  part_ends(piece);
  const size_t parts = part_ends_.size();
  double from = 0;
  for (size_t i = 0; i < parts; ++i) {
    PlanPiece part = piece;
    if (parts > 1) part.piece = cut(piece.piece, from, part_ends_[i]);
    part.ends_stretch = piece.ends_stretch && i + 1 == parts;
    if (i > 0) part.outputs = {};
    if (parts > 1) sampler_.curve(part, curve_);
    accept(part);
    from = part_ends_[i];
  }
  if (piece.ends_stretch) {
    advance(true);
    open_ = false;
  }
}

// Where a piece is cut, so that no part is long against the window of the plan. A piece at one feed that
// would have thousands of parts is cut near its ends only; its middle is one part.
void WindowPlanner::part_ends(const PlanPiece& piece) {
  const double length = piece.piece.length, part_s = 0.6 * brake_s_;
  const double b = sampler_.sample(piece, curve_, length / 2, 0, 0).b_max;
  const double parts = std::max(1.0, std::ceil(length / std::sqrt(b) / part_s));
  const auto one_feed = [&] {
    for (int i = 0; i <= kFeedSamples; ++i) {
      const double here = sampler_.sample(piece, curve_, length * i / kFeedSamples, 0, 0).b_max;
      if (std::abs(here - b) > 1e-9 * b) return false;
    }
    return true;
  };
  const bool even = parts > kPartsMost && one_feed();
  part_ends_.clear();
  for (double i = 1; i <= parts; ++i) {
    if (even && i > kPartsMost / 4 && i <= parts - kPartsMost / 4) continue;
    part_ends_.push_back(length * i / parts);
  }
}

void WindowPlanner::accept(const PlanPiece& piece) {
  grid_.add(piece, curve_);
  emitter_.add_piece(piece, s_next_);
  s_next_ += piece.piece.length;
  if (!piece.ends_stretch) advance(false);
}

void WindowPlanner::event(const QueueEvent& event, SourceLine source) {
  finish();
  if (failed_) return;
  emitter_.event(event, source);
  TRN_CHECK(!open_);
  stats_.blocks = emitter_.block_count();
}

void WindowPlanner::finish() {
  if (!open_) return;
  or_end_at_rest([&] {
    advance(true);
    open_ = false;
  });
}

// Lays the grid as far as the future is known and plans windows while there is enough of it.
void WindowPlanner::advance(bool to_end) {
  const bool crowded = emitter_.piece_count() > options_.buffered_pieces_max;
  if (!grid_.lay(to_end, crowded) && !crowded && !to_end) return;
  headroom_.resize(grid_.intervals().size(), kFreshHeadroom);
  while (!grid_.intervals().empty()) {
    double time_s = 0;
    for (const GridInterval& g : grid_.intervals()) time_s += g.time_est_s;
    const bool full = time_s > std::max(options_.window_s, kWindow * stretch_brake_s_) ||
                      grid_.intervals().size() > 6000 ||
                      emitter_.piece_count() > options_.buffered_pieces_max;
    if (!to_end && (!full || grid_.intervals().size() < 40)) return;
    plan_window(to_end);
  }
}

double WindowPlanner::law_time() const {
  double t = 0;
  for (const LawSegment& segment : law_) t += segment.duration_s;
  return t;
}

// Plans the next window. If the whole grid has no plan, shorter windows are tried. If these have none either,
// the plan that was verified before still leads to a standstill: a sixth of it is emitted and the window
// tried again from there, and when it runs out the machine stops (`fallbacks`) and goes on from rest. From
// rest, where there is no plan to fall back on, the window is slowed down as a whole, and at last driven as
// one slow S-curve.
void WindowPlanner::plan_window(bool final) {
  if (try_window(final)) return;
  const double least = start_.at_rest ? 0 : static_cast<double>(law_.size());
  for (const double share : {0.6, 0.3, 0.12})
    if (try_shorter(
            static_cast<size_t>(least + share * (static_cast<double>(grid_.intervals().size()) - least))))
      return;
  ++retries_;
  if (!start_.at_rest && law_.size() > 4) return commit(segments_within(law_time() / 6), 0);
  const size_t head = rest_intervals(grid_.intervals(), false),
               tail = rest_intervals(grid_.intervals(), true);
  if (!start_.at_rest) {
    ++stats_.fallbacks;
  } else if (grid_.intervals().size() >= kIntervalsMin &&
             (solve_window(head, tail) || slow_down(head, tail))) {
    adopt();
  } else {
    plan_s_curve();
  }
  retries_ = 0;
  emit_rest();
}

// Plans the grid as it is, emits the first half of the plan, or all when `final`. False: found none.
bool WindowPlanner::try_window(bool final) {
  const auto& grid = grid_.intervals();
  ++stats_.windows;
  const size_t head = start_.at_rest ? rest_intervals(grid, false) : 0, tail = rest_intervals(grid, true);
  const bool enough = grid.size() >= kIntervalsMin && (head > 0) == start_.at_rest && tail > 0;
  if (!enough || !solve_window(head, tail)) return false;
  adopt();
  retries_ = 0;
  if (final) {
    emit_rest();
  } else {
    // A window that ends in a slow place creeps to its rest there: 0.36 s for 0.2 mm. That time is no room to
    // brake.
    const double creep_s = std::max(0.0, law_.back().duration_s - stretch_brake_s_);
    const double driven_s = law_time() - creep_s;
    commit(segments_within(std::max(driven_s / 2, driven_s - kProvisional * stretch_brake_s_)), head);
  }
  return true;
}

// try_window on the first `count` intervals only, with fresh headroom; the rest of the grid is set aside
// meanwhile.
bool WindowPlanner::try_shorter(size_t count) {
  auto& grid = grid_.intervals();
  if (count < kShortWindowMin || count >= grid.size()) return false;
  const auto cut = grid.begin() + static_cast<std::ptrdiff_t>(count);
  std::vector<GridInterval> aside(std::make_move_iterator(cut), std::make_move_iterator(grid.end()));
  grid.erase(cut, grid.end());
  headroom_.assign(count, kFreshHeadroom);
  const bool found = try_window(false);
  grid.insert(grid.end(), std::make_move_iterator(aside.begin()), std::make_move_iterator(aside.end()));
  headroom_.resize(grid.size(), kFreshHeadroom);
  return found;
}

// The candidate is verified: it is the plan from now on.
void WindowPlanner::adopt() {
  TRN_CHECK(!candidate_.empty());
  law_ = candidate_;
  c_before_ = c_;
  nodes_before_.clear();
  for (size_t k = 0; k < problem_.intervals; ++k) nodes_before_.push_back(problem_.at_node(c_, k));
}

// The number of segments of the plan that begin within `time_s`; at least two segments are left.
size_t WindowPlanner::segments_within(double time_s) const {
  TRN_CHECK(law_.size() >= (start_.at_rest ? 4u : 3u));
  size_t count = 0;
  for (double t = 0; count < law_.size() && t < time_s; ++count) t += law_[count].duration_s;
  return std::clamp<size_t>(count, start_.at_rest ? 2 : 1, law_.size() - 2);
}

// Rounds of: set up the problem, solve it, make the time law, verify it. Where the law exceeds a limit,
// verify lowers the headroom, and the solver resumes. Where no law can be made, because constant jerk would
// turn back in a dip of the spline, that dip is damped and the solver begins anew from the last solution.
bool WindowPlanner::solve_window(size_t head, size_t tail) {
  initial_guess(head, tail);
  const auto& grid = grid_.intervals();
  const size_t n = grid.size() - head - tail;
  bool fresh = true;
  Doubles found;  // the last solution
  changed_.clear();
  for (int round = 0; round < options_.rounds_max; ++round) {
    ++stats_.rounds;
    head_end_.at_rest = start_.at_rest;
    head_end_.state = start_.plan;
    if (start_.at_rest) {
      head_end_.rest_length = grid[head].s - grid[0].s;
      head_end_.b_max = rest_bound(grid, 0, head, sampler_.rates(), headroom_, true);
    }
    tail_end_.rest_length = grid.back().s + grid.back().h - grid[head + n].s;
    tail_end_.b_max = rest_bound(grid, head + n, grid.size(), sampler_.rates(), headroom_, false);
    build_problem(grid, head, n, sampler_.rates(), headroom_, head_end_, tail_end_, changed_, problem_);
    changed_.assign(grid.size(), false);
    const InteriorPointResult result =
        fresh ? solver_.solve(problem_, kFirstSolve, c_) : solver_.resume(problem_, kNextSolve, c_);
    stats_.iterations += static_cast<std::uint64_t>(result.iterations);
    if (result.feasible) found = c_;
    if (result.feasible && make_law(head, tail)) {
      if (verify(round)) return true;
      fresh = false;
    } else {
      if (fresh && !result.feasible) {
        if (round > 0) return false;
        slow_guess(head, tail);
        continue;
      }
      if (result.feasible) damp_undershoot(head);
      c_ = found;  // with fresh slacks and multipliers
      fresh = true;
    }
  }
  return false;
}

// The law ended in an interval where the spline dips so sharply that constant jerk would turn back. Its rows
// P13, and those of the intervals beside it, get a smaller dip.
void WindowPlanner::damp_undershoot(size_t head) {
  const size_t at = head + candidate_.size() - (start_.at_rest ? 1 : 0);
  for (size_t k = at > 0 ? at - 1 : 0; k < std::min(at + 2, headroom_.size()); ++k)
    lower(k).dip = std::max(0.6, headroom_[k].dip * kUndershoot);
}

// How many intervals of the window begin with the plan before: all but its end, where it brakes for a
// standstill that the new plan need not make. None from rest; at least the first after a moving start, which
// is given.
size_t WindowPlanner::kept_intervals(size_t n) const {
  if (start_.at_rest) return 0;
  const auto& grid = grid_.intervals();
  size_t keep = 1;
  double left_s = 0;
  for (size_t k = c_before_.size(); k-- > 0;) {
    left_s += grid[k].h / std::sqrt(c_before_[k]);
    if (left_s > 0.7 * stretch_brake_s_ + 8 * options_.node_spacing_s) {
      keep = k + 1;
      break;
    }
  }
  return std::min({keep, n, std::max<size_t>(c_before_.size(), 1)});
}

// (ds/dt)^2 of the window's intervals: what the plan before had for the first `keep`, then the grid's
// estimate, as far as constant jerk from the start and to the standstill allows it. Windows that failed
// before begin slower.
Doubles WindowPlanner::estimated_speeds(size_t head, size_t n, size_t keep) const {
  const auto& grid = grid_.intervals();
  const double slower = std::pow(0.7, std::min(retries_, 6));
  const double s_start = grid[0].s, s_stop = grid.back().s + grid.back().h;
  Doubles b(n);
  for (size_t k = 0; k < n; ++k) {
    const GridInterval& g = grid[head + k];
    const double mid = g.s + g.h / 2, to_stop = s_stop - mid, from_start = mid - s_start;
    b[k] = slower * std::min(g.b_est, g.bound.b);
    b[k] = std::min(b[k], from_rest_b(g.bound.jerk, to_stop));
    if (start_.at_rest) b[k] = std::min(b[k], from_rest_b(g.bound.jerk, from_start));
  }
  const double first_c = start_.plan.b + start_.plan.a * grid[0].h;
  for (size_t k = 0; k < keep; ++k) b[k] = k < c_before_.size() ? c_before_[k] : first_c;
  return b;
}

// The solver's start. It need not keep the rows, but the search is short only from a smooth profile a little
// below them.
void WindowPlanner::initial_guess(size_t head, size_t tail) {
  const auto& grid = grid_.intervals();
  const size_t n = grid.size() - head - tail, keep = kept_intervals(n);
  c_ = estimated_speeds(head, n, keep);
  limit_acceleration(grid, head, keep, c_);
  smooth_below(keep, c_);
}

// Another start for a search that has not come to where all rows are kept, as before a place that is hundreds
// of times slower than the way to it: from far below it does.
void WindowPlanner::slow_guess(size_t head, size_t tail) {
  initial_guess(head, tail);
  const size_t keep = start_.at_rest ? 0 : 1;
  for (size_t k = keep; k < c_.size(); ++k) c_[k] *= kSlowGuess;
  limit_acceleration(grid_.intervals(), head, keep, c_);
  smooth_below(keep, c_);
}

bool WindowPlanner::make_law(size_t head, size_t tail) {
  const auto& grid = grid_.intervals();
  candidate_.clear();
  PathState from = start_.state;
  if (start_.at_rest) {
    const SpeedState first = problem_.at_node(c_, 0);
    candidate_.push_back(rest_start(grid, 0, head, first.b));
    from = {grid[head].s, std::sqrt(first.b), first.a};
  }
  if (!make_time_law(grid, head, problem_, c_, from, tail_end_.rest_length, candidate_)) return false;
  const PathState end = candidate_.back().end();
  const size_t first = grid.size() - tail;
  candidate_.push_back(rest_stop(grid, first, grid.size(), {grid[first].s, end.v, end.a}));
  return true;
}

// Judges the candidate at every sample and between them. Where it exceeds a limit, lowers the headroom by the
// excess and a little more, more in later rounds. `round` < 0: judges only.
bool WindowPlanner::verify(int round) {
  bool good = true;
  // Beside a slow place of a few micrometres the speed falls by a small share only of what its bound is
  // lowered by.
  const double firmer = std::max(1.0, 0.5 * round);
  for (const LawSegment& segment : candidate_) {
    for (size_t k = segment.first; k < segment.last; ++k) {
      const LimitUse use = limit_use(segment, grid_.intervals()[k], sampler_.rates());
      const double velocity = std::sqrt(use.velocity_squared) / kVelocityAccept,
                   acceleration = use.acceleration / kAccelerationAccept, jerk = use.jerk / kJerkAccept;
      if (!(velocity > 1) && !(acceleration > 1) && !(jerk > 1)) continue;
      good = false;
      if (round < 0) return false;
      const double extra = 1 + 0.001 * (1 << std::min(round, 5));  // and somewhat more than it exceeds
      Headroom& room = lower(k);
      if (velocity > 1) lower_velocity(room, velocity, firmer);
      if (acceleration > 1) room.acceleration /= std::pow(acceleration, 1.3) * extra;
      if (jerk > 1) room.jerk /= std::pow(jerk, 1.3) * extra;
      if (jerk > 1 && round >= kSlowerFrom) lower_speed(k, segment, jerk);
    }
  }
  return good;
}

// The bound is on the square of the speed. Beside a slow place the spline goes down to that place's bound,
// and the speed falls by a share only of what the bound is lowered by: what the last round has brought tells
// which.
void WindowPlanner::lower_velocity(Headroom& room, double excess, double firmer) {
  const double now = std::log(excess), gained = room.velocity_excess - now;
  double lowered = 2 * firmer * now;
  if (room.velocity_lowered > 0 && gained > 0)
    lowered = std::max(lowered, std::min(room.velocity_lowered * now / gained, kLoweredMax));
  room.velocity_excess = now;
  room.velocity_lowered = lowered;
  room.velocity *= std::exp(-lowered) / 1.0001;
}

// The headroom of an interval, to be lowered.
Headroom& WindowPlanner::lower(size_t interval) {
  changed_[interval] = true;
  return headroom_[interval];
}

// The jerk's excess at one place has not gone after some rounds: what causes it lies between the rows. Jerk
// falls with the third power of speed in any case, so the bound of speed is lowered, to a little more than
// the excess asks for.
void WindowPlanner::lower_speed(size_t interval, const LawSegment& segment, double excess) {
  const double v = std::max(segment.from.v, segment.end().v);
  const auto& grid = grid_.intervals();
  const double bound = coefficient_bound(grid, 0, grid.size(), interval);
  double& room = headroom_[interval].velocity;
  room = std::min(room, v * v / bound / std::pow(excess, 0.8) * 0.99);
}

// The whole window from rest to rest, slower and slower until it keeps all limits.
bool WindowPlanner::slow_down(size_t head, size_t tail) {
  ++stats_.slowed;
  for (int i = 0; i < 60; ++i) {
    for (double& c : c_) c *= 0.9;
    if (make_law(head, tail) && verify(-1)) return true;
  }
  return false;
}

// A very short stretch, or the last resort from rest: an S-curve of four segments of equal jerk, slower and
// slower until it keeps all limits.
void WindowPlanner::plan_s_curve() {
  const auto& grid = grid_.intervals();
  const double s0 = grid[0].s, length = grid.back().s + grid.back().h - s0;
  double jerk = 1e12;
  for (const GridInterval& g : grid) jerk = std::min(jerk, g.bound.jerk);
  do {
    const double T = std::cbrt(length / (2 * jerk));
    candidate_.clear();
    PathState from{s0, 0, 0};
    for (const double sign : {1.0, -1.0, -1.0, 1.0}) {
      LawSegment segment{from, sign * jerk, T, 0, grid.size()};
      from = segment.end();
      candidate_.push_back(segment);
    }
    jerk *= 0.8;
  } while (!verify(-1));
  law_ = candidate_;
}

// Emits the first `segments` of the plan. The next window begins at their end, with the true motion there and
// with what the solution had, which differ by the time law's correction.
void WindowPlanner::commit(size_t segments, size_t head) {
  const size_t offset = start_.at_rest ? 1 : 0;  // the rest segment has no coefficient
  const size_t regular = segments - offset;
  for (size_t i = 0; i < segments; ++i) {
    emitter_.segment(law_[i], grid_.intervals(), false);
    stats_.time_s += law_[i].duration_s;
  }
  start_.state = law_[segments].from;
  start_.plan = nodes_before_[regular];
  start_.at_rest = false;
  c_before_.erase(c_before_.begin(), c_before_.begin() + static_cast<std::ptrdiff_t>(regular));
  nodes_before_.erase(nodes_before_.begin(), nodes_before_.begin() + static_cast<std::ptrdiff_t>(regular));
  law_.erase(law_.begin(), law_.begin() + static_cast<std::ptrdiff_t>(segments));
  drop_intervals(head + regular);
  stats_.blocks = emitter_.block_count();
}

void WindowPlanner::drop_intervals(size_t count) {
  stats_.intervals += count;
  grid_.drop_front(count);
  headroom_.erase(headroom_.begin(), headroom_.begin() + static_cast<std::ptrdiff_t>(count));
  for (LawSegment& segment : law_) {
    segment.first -= count;
    segment.last -= count;
  }
}

// Emits the verified plan to its standstill.
void WindowPlanner::emit_rest() {
  if (law_.empty()) return;
  for (size_t i = 0; i < law_.size(); ++i) {
    emitter_.segment(law_[i], grid_.intervals(), i + 1 == law_.size());
    stats_.time_s += law_[i].duration_s;
  }
  const size_t count = law_.back().last;
  law_.clear();
  c_before_.clear();
  drop_intervals(count);
  start_ = Start{};
  stats_.blocks = emitter_.block_count();
}

}  // namespace trn::speed
