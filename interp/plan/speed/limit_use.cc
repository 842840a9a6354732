#include "interp/plan/speed/limit_use.h"

#include <algorithm>
#include <cmath>

namespace trn::speed {

namespace {

constexpr int kNewtonSteps = 4;
constexpr float kOutside = 1e-5F;  // of a segment's way: places farther off are not in it
constexpr float kJudged = 1e-4F;   // of a segment's duration: how close a moment is hit to judge it

double power_2_3(double x) { return std::cbrt(x * x); }

/// A place of an interval to be judged: a sample, or between, on the parabola through three.
struct Place {
  double s;
  const PathSample* first;  ///< of the three samples
  double weight[3];         ///< of each
};

// The samples, and a third and two thirds of the way between them, where there are three samples.
std::vector<Place> places_of(const std::vector<PathSample>& p) {
  std::vector<Place> out;
  out.reserve(3 * p.size());
  for (size_t i = 0; i < p.size(); ++i) {
    out.push_back({p[i].s, &p[i], {1, 0, 0}});
    if (i + 1 == p.size() || p[i + 1].s <= p[i].s) continue;
    const size_t k = i > 0 && p[i - 1].s < p[i].s ? i - 1 : i;
    if (k + 2 >= p.size() || p[k + 2].s <= p[k + 1].s) continue;
    const double ab = p[k].s - p[k + 1].s, ac = p[k].s - p[k + 2].s, bc = p[k + 1].s - p[k + 2].s;
    for (const double part : {1.0 / 3, 2.0 / 3}) {
      const double s = p[i].s + part * (p[i + 1].s - p[i].s);
      const double a = s - p[k].s, b = s - p[k + 1].s, c = s - p[k + 2].s;
      out.push_back({s, &p[k], {b * c / (ab * ac), -a * c / (ab * bc), a * b / (ac * bc)}});
    }
  }
  return out;
}

/// Sixteen places' values of what the rows are made of, [joint][place].
struct PlaceValues {
  double d1[kMaxJoints][kLanes], d2[kMaxJoints][kLanes], d3[kMaxJoints][kLanes], b_max[kLanes];
};

void put_place(const Place& place, size_t joints, size_t lane, PlaceValues& out) {
  const PathSample& p = place.first[0];
  if (place.weight[0] == 1) {
    out.b_max[lane] = p.b_max;
    for (size_t j = 0; j < joints; ++j) {
      out.d1[j][lane] = p.d1[j];
      out.d2[j][lane] = p.d2[j];
      out.d3[j][lane] = p.d3[j];
    }
    return;
  }
  const PathSample &q = place.first[1], &r = place.first[2];
  const double u = place.weight[0], v = place.weight[1], w = place.weight[2];
  out.b_max[lane] = u * p.b_max + v * q.b_max + w * r.b_max;
  for (size_t j = 0; j < joints; ++j) {
    out.d1[j][lane] = u * p.d1[j] + v * q.d1[j] + w * r.d1[j];
    out.d2[j][lane] = u * p.d2[j] + v * q.d2[j] + w * r.d2[j];
    out.d3[j][lane] = u * p.d3[j] + v * q.d3[j] + w * r.d3[j];
  }
}

TRN_VECTOR_INLINE void scaled(const double* values, double scale, Lanes& to) {
  Wide wide;
  std::memcpy(&wide, values, sizeof wide);
  to = __builtin_convertvector(wide * scale, Lanes);
}

TRN_VECTOR_CLONES void put_group(const PlaceValues& values, const JointRates& rates, JudgedPlaces& places,
                                 JudgeRow* rows) {
  scaled(values.b_max, 1, places.b_max);
  for (size_t j = 0; j < static_cast<size_t>(rates.count); ++j) {
    scaled(values.d1[j], rates.acceleration_inverse[j], rows[j].d1);
    scaled(values.d2[j], rates.acceleration_inverse[j], rows[j].d2);
    scaled(values.d3[j], rates.jerk_inverse[j], rows[j].d3);
  }
}

void put_rows(const std::vector<Place>& places, const JointRates& rates, GridInterval& g) {
  const size_t groups = lane_groups(places.size()), joints = static_cast<size_t>(rates.count);
  g.judged.resize(groups);
  g.judge.resize(groups * joints);
  for (size_t group = 0; group < groups; ++group) {
    PlaceValues values;
    for (size_t lane = 0; lane < kLanes; ++lane) {
      const Place& place =
          places[std::min(group * kLanes + lane, places.size() - 1)];  // the last one fills up
      g.judged[group].share[lane] = static_cast<float>((place.s - g.s) / g.h);
      put_place(place, joints, lane, values);
    }
    put_group(values, rates, g.judged[group], &g.judge[group * joints]);
  }
}

TRN_VECTOR_INLINE void size_of(const Lanes& v, Lanes& size) { size = v > -v ? v : -v; }

/// Shares of a segment's way that shares of its time make: x = rate t + bend t^2 + turn t^3.
struct Course {
  float rate, bend, turn;
};

Course course_of(const LawSegment& segment, double length) {
  const double T = segment.duration_s, by = T / length;
  return {static_cast<float>(segment.from.v * by), static_cast<float>(segment.from.a * T * by / 2),
          static_cast<float>(segment.jerk * T * T * by / 6)};
}

// Newton's method from even motion on all lanes. False: not everywhere there, as next to a standstill.
TRN_VECTOR_INLINE bool time_shares(const Course& c, const Lanes& x, Lanes& t) {
  t = x;
  Lanes miss{};
  for (int i = 0; i < kNewtonSteps; ++i) {
    const Lanes slope = c.rate + t * (2 * c.bend + t * (3 * c.turn));
    const Lanes step = (t * (c.rate + t * (c.bend + t * c.turn)) - x) / slope;
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

/// The path parameter's motion at sixteen moments.
struct Moments {
  Lanes v, a, jerk;
};

TRN_VECTOR_INLINE void use_group(const JudgedPlaces& places, const JudgeRow* rows, const JointRates& rates,
                                 const Moments& at, LaneUse& use) {
  const Lanes b = at.v * at.v, va3 = 3 * at.v * at.a, vvv = b * at.v;
  raise(use.velocity_squared, b / places.b_max);
  for (size_t j = 0; j < static_cast<size_t>(rates.count); ++j) {
    const JudgeRow& d = rows[j];
    const auto ramp = static_cast<float>(rates.acceleration[j] * rates.jerk_inverse[j]);
    Lanes size;
    size_of(d.d1 * at.a + d.d2 * b, size);
    raise(use.acceleration, size);
    size_of(ramp * (d.d1 * at.jerk + d.d2 * va3) + d.d3 * vvv, size);
    raise(use.jerk, size);
  }
}

}  // namespace

TRN_VECTOR_CLONES LimitUse limit_use(const LawSegment& segment, GridInterval& g, const JointRates& rates) {
  if (g.judged.empty()) put_rows(places_of(g.samples), rates, g);
  const size_t joints = static_cast<size_t>(rates.count);
  const double length = segment.end().s - segment.from.s;
  const Course course = course_of(segment, length);
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
                here = off * off < kOutside * kOutside ? zero + 1 : zero;  // or in another one
    const Moments at{here * (v0 + t * (a0 + t * (jerk / 2))), here * (a0 + t * jerk), here * jerk};
    use_group(g.judged[group], &g.judge[group * joints], rates, at, use);
  }
  return {largest(use.velocity_squared), largest(use.acceleration), largest(use.jerk)};
}

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
