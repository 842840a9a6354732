#include "interp/plan/speed/limit_use.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "interp/plan/lanes.h"
#include "interp/plan/speed/path_sampler.h"

namespace trn::speed {

namespace {

constexpr int kNewtonSteps = 4;
constexpr float kOutside = 1e-5F;  // of a segment's length: samples farther outside belong to another segment
constexpr float kJudged = 1e-4F;   // of a segment's duration: how close a moment is hit to judge it

double power_2_3(double x) { return std::cbrt(x * x); }

/// A group of places of an interval at which the law is judged. Each is a weighted sum of the interval's
/// samples: one of them, or between two of them the parabola through three.
struct SampleGroup {
  Lanes share;                 ///< of the interval
  size_t first = 0, used = 0;  ///< samples that are taken from
  Wide weight[kLanes + 4];     ///< of each
};

TRN_VECTOR_CLONES void put_group(const SampleGroup& group, const PathSample* samples, const JointRates& rates,
                                 JudgedSamples& judged, JudgeRow* rows) {
  const PathSample* const p = samples + group.first;
  judged.share = group.share;
  Wide b_max{};
  for (size_t i = 0; i < group.used; ++i) b_max += group.weight[i] * p[i].b_max;
  judged.b_max = __builtin_convertvector(b_max, Lanes);
  for (size_t j = 0; j < static_cast<size_t>(rates.count); ++j) {
    Wide d1{}, d2{}, d3{};
    for (size_t i = 0; i < group.used; ++i) {
      const Wide& weight = group.weight[i];
      d1 += weight * p[i].d1[j];
      d2 += weight * p[i].d2[j];
      d3 += weight * p[i].d3[j];
    }
    rows[j].d1 = __builtin_convertvector(d1 * rates.acceleration_inverse[j], Lanes);
    rows[j].d2 = __builtin_convertvector(d2 * rates.acceleration_inverse[j], Lanes);
    rows[j].d3 = __builtin_convertvector(d3 * rates.jerk_inverse[j], Lanes);
  }
}

/// Gathers the places of an interval into groups and writes these into the interval's rows.
class RowWriter {
 public:
  RowWriter(const JointRates& rates, GridInterval& g) : rates_(rates), g_(g) {}

  /// A place at s that takes these weights of the samples from `first` on. A place's first sample is at most
  /// one before that of the place put before it.
  void put(double s, size_t first, std::span<const double> weights) {
    if (lane_ == 0) {
      group_.first = first > 0 ? first - 1 : 0;
      group_.used = 0;
    }
    const size_t at = first - group_.first;
    while (group_.used < at + weights.size()) group_.weight[group_.used++] = Wide{};
    for (size_t i = 0; i < weights.size(); ++i) group_.weight[at + i][lane_] = weights[i];
    group_.share[lane_] = static_cast<float>((s - g_.s) / g_.h);
    if (++lane_ == kLanes) flush();
  }

  /// Fills up the last group with its last place.
  void finish() {
    if (lane_ == 0) return;
    for (size_t lane = lane_; lane < kLanes; ++lane) {
      group_.share[lane] = group_.share[lane_ - 1];
      for (size_t i = 0; i < group_.used; ++i) group_.weight[i][lane] = group_.weight[i][lane_ - 1];
    }
    flush();
  }

 private:
  void flush() {
    const size_t joints = static_cast<size_t>(rates_.count);
    JudgedSamples& judged = g_.judged.emplace_back();
    g_.judge.resize(g_.judged.size() * joints);
    put_group(group_, g_.samples.data(), rates_, judged, &g_.judge[g_.judge.size() - joints]);
    lane_ = 0;
  }

  const JointRates& rates_;
  GridInterval& g_;
  SampleGroup group_;
  size_t lane_ = 0;
};

// The samples, and a third and two thirds of the way between them, where there are three samples.
void put_rows(const JointRates& rates, GridInterval& g) {
  const std::vector<PathSample>& p = g.samples;
  g.judge.clear();
  RowWriter rows(rates, g);
  for (size_t i = 0; i < p.size(); ++i) {
    rows.put(p[i].s, i, std::array{1.0});
    if (i + 1 == p.size() || p[i + 1].s <= p[i].s) continue;
    const size_t k = i > 0 && p[i - 1].s < p[i].s ? i - 1 : i;
    if (k + 2 >= p.size() || p[k + 2].s <= p[k + 1].s) continue;
    const double ab = p[k].s - p[k + 1].s, ac = p[k].s - p[k + 2].s, bc = p[k + 1].s - p[k + 2].s;
    for (const double part : {1.0 / 3, 2.0 / 3}) {
      const double s = p[i].s + part * (p[i + 1].s - p[i].s);
      const double a = s - p[k].s, b = s - p[k + 1].s, c = s - p[k + 2].s;
      rows.put(s, k, std::array{b * c / (ab * ac), -a * c / (ab * bc), a * b / (ac * bc)});
    }
  }
  rows.finish();
}

TRN_VECTOR_INLINE void size_of(const Lanes& v, Lanes& size) { size = v > -v ? v : -v; }

/// The segment's motion over its length and duration: x = linear t + quadratic t^2 + cubic t^3, x and t in
/// [0, 1].
struct NormalisedMotion {
  float linear, quadratic, cubic;
};

NormalisedMotion normalised(const LawSegment& segment, double length) {
  const double T = segment.duration_s, by = T / length;
  return {static_cast<float>(segment.from.v * by), static_cast<float>(segment.from.a * T * by / 2),
          static_cast<float>(segment.jerk * T * T * by / 6)};
}

// The time shares t at which the motion has come to the shares x of its length: Newton's method on all lanes
// at once, starting from constant speed. False: not converged on some lane, as next to a standstill, where
// dx/dt vanishes.
TRN_VECTOR_INLINE bool time_shares(const NormalisedMotion& c, const Lanes& x, Lanes& t) {
  t = x;
  Lanes miss{};
  for (int i = 0; i < kNewtonSteps; ++i) {
    const Lanes slope = c.linear + t * (2 * c.quadratic + t * (3 * c.cubic));
    const Lanes step = (t * (c.linear + t * (c.quadratic + t * c.cubic)) - x) / slope;
    t -= step;
    t = t > 0 ? t : Lanes{};
    t = t < 1 ? t : Lanes{} + 1;
    size_of(step, miss);
  }
  return largest(miss) < kJudged;  // of the last step: what is left is far less
}

/// Worst so far, by lane.
struct LaneUse {
  Lanes velocity_squared{}, acceleration{}, jerk{};
};

/// The path parameter's motion at a group of moments.
struct Moments {
  Lanes v, a, jerk;
};

TRN_VECTOR_INLINE void use_group(const JudgedSamples& judged, const JudgeRow* rows, const JointRates& rates,
                                 const Moments& at, LaneUse& use) {
  const Lanes b = at.v * at.v, va3 = 3 * at.v * at.a, vvv = b * at.v;
  raise(use.velocity_squared, b / judged.b_max);
  for (size_t j = 0; j < static_cast<size_t>(rates.count); ++j) {
    const JudgeRow& d = rows[j];
    const auto ramp = static_cast<float>(rates.acceleration[j] * rates.jerk_inverse[j]);
    Lanes size;
    size_of(d.d1 * at.a + d.d2 * b, size);
    raise(use.acceleration, size);
    // q' and q'' are stored over the limit of acceleration; `ramp` makes them shares of the jerk limit.
    size_of(ramp * (d.d1 * at.jerk + d.d2 * va3) + d.d3 * vvv, size);
    raise(use.jerk, size);
  }
}

}  // namespace

// The interval's rows are formed at the first call only: an interval is judged once a round of the planner,
// always at the same places. What changes is the segment, and with it time, speed and acceleration at these
// places.
TRN_VECTOR_CLONES LimitUse limit_use(const LawSegment& segment, GridInterval& g, const JointRates& rates) {
  if (g.judged.empty()) put_rows(rates, g);
  const size_t joints = static_cast<size_t>(rates.count);
  const double length = segment.end().s - segment.from.s;
  const NormalisedMotion course = normalised(segment, length);
  const auto offset = static_cast<float>((g.s - segment.from.s) / length),
             share = static_cast<float>(g.h / length), T = static_cast<float>(segment.duration_s),
             v0 = static_cast<float>(segment.from.v), a0 = static_cast<float>(segment.from.a),
             jerk = static_cast<float>(segment.jerk);
  LaneUse use;
  for (size_t group = 0; group < g.judged.size(); ++group) {
    const Lanes place = offset + share * g.judged[group].share, zero{};
    Lanes x = place > 0 ? place : zero, t;
    x = x < 1 ? x : zero + 1;
    if (!time_shares(course, x, t))
      for (size_t i = 0; i < kLanes; ++i)
        t[i] = static_cast<float>(segment.time_at(segment.from.s + static_cast<double>(x[i]) * length) /
                                  segment.duration_s);
    t *= T;
    const Lanes off = place - x,
                here =
                    off * off < kOutside * kOutside ? zero + 1 : zero;  // else the place does not count here
    const Moments at{here * (v0 + t * (a0 + t * (jerk / 2))), here * (a0 + t * jerk), here * jerk};
    use_group(g.judged[group], &g.judge[group * joints], rates, at, use);
  }
  return {largest(use.velocity_squared), largest(use.acceleration), largest(use.jerk)};
}

// A rest segment of another end speed is the same motion, faster or slower: with b, speeds grow as sqrt(b),
// accelerations as b and jerks as b^1.5. So the uses of the motion with b = 1 give the greatest b in closed
// form.
double rest_bound(const std::deque<GridInterval>& grid, size_t first, size_t last, const JointRates& rates,
                  const std::deque<Headroom>& headroom, bool start) {
  const double s0 = grid[first].s, length = grid[last - 1].s + grid[last - 1].h - s0;
  LawSegment unit = rest_start(grid, first, last, 1);
  if (!start) unit = rest_stop(grid, first, last, {s0, 1, 0});
  double b = 1e12;
  for (size_t k = first; k < last; ++k) {
    const Headroom& room = headroom[k];
    for (const PathSample& p : grid[k].samples) {
      const PathState at = unit.at(unit.time_at(std::clamp(p.s, s0, s0 + length)));
      const double vv = at.v * at.v;
      if (vv > 0) b = std::min(b, room.velocity * p.b_max / vv);
      for (size_t j = 0; j < static_cast<size_t>(rates.count); ++j) {
        const double a = std::abs(p.d1[j] * at.a + p.d2[j] * vv),
                     third = std::abs(p.d1[j] * unit.jerk + p.d2[j] * 3 * at.v * at.a + p.d3[j] * vv * at.v);
        if (a > 0) b = std::min(b, room.acceleration * rates.acceleration[j] / a);
        if (third > 0) b = std::min(b, power_2_3(room.jerk * rates.jerk[j] / third));
      }
    }
  }
  return b;
}

}  // namespace trn::speed
