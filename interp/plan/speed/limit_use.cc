#include "interp/plan/speed/limit_use.h"

#include <algorithm>
#include <cmath>

namespace trn::speed {

namespace {

constexpr double kJudged = 1e-4;  // of a segment's duration: how close a moment is hit to judge it

JudgeRow judge_row(const PathSample& p, const JointRates& rates) {
  JudgeRow row{};
  row.b_max = p.b_max;
  for (size_t j = 0; j < static_cast<size_t>(rates.count); ++j) {
    const double a = rates.acceleration_inverse[j], third = rates.jerk_inverse[j];
    row.a1[j] = static_cast<float>(p.d1[j] * a);
    row.a2[j] = static_cast<float>(p.d2[j] * a);
    row.j1[j] = static_cast<float>(p.d1[j] * third);
    row.j2[j] = static_cast<float>(p.d2[j] * third);
    row.j3[j] = static_cast<float>(p.d3[j] * third);
  }
  return row;
}

/// Worst so far, by joint.
struct JointUse {
  Lanes acceleration{}, jerk{};
  double velocity_squared = 0;
};

TRN_VECTOR_INLINE void raise_size(Lanes& to, const Lanes& by) {
  const Lanes size = by > -by ? by : -by;
  to = size > to ? size : to;
}

TRN_VECTOR_INLINE void use_row(const JudgeRow& row, const PathState& at, double jerk, JointUse& use) {
  const double vv = at.v * at.v;
  const auto a = static_cast<float>(at.a), b = static_cast<float>(vv), j = static_cast<float>(jerk),
             va3 = static_cast<float>(3 * at.v * at.a), vvv = static_cast<float>(vv * at.v);
  use.velocity_squared = std::max(use.velocity_squared, vv / row.b_max);
  raise_size(use.acceleration, row.a1 * a + row.a2 * b);
  raise_size(use.jerk, row.j1 * j + row.j2 * va3 + row.j3 * vvv);
}

// The row at s on the parabola through three samples.
TRN_VECTOR_INLINE void row_between(const PathSample* p, const JudgeRow* row, double s, JudgeRow& out) {
  const double a = s - p[0].s, b = s - p[1].s, c = s - p[2].s;
  const double ab = p[0].s - p[1].s, ac = p[0].s - p[2].s, bc = p[1].s - p[2].s;
  const double w0 = b * c / (ab * ac), w1 = -a * c / (ab * bc), w2 = a * b / (ac * bc);
  const auto n0 = static_cast<float>(w0), n1 = static_cast<float>(w1), n2 = static_cast<float>(w2);
  out.b_max = w0 * row[0].b_max + w1 * row[1].b_max + w2 * row[2].b_max;
  out.a1 = n0 * row[0].a1 + n1 * row[1].a1 + n2 * row[2].a1;
  out.a2 = n0 * row[0].a2 + n1 * row[1].a2 + n2 * row[2].a2;
  out.j1 = n0 * row[0].j1 + n1 * row[1].j1 + n2 * row[2].j1;
  out.j2 = n0 * row[0].j2 + n1 * row[1].j2 + n2 * row[2].j2;
  out.j3 = n0 * row[0].j3 + n1 * row[1].j3 + n2 * row[2].j3;
}

LimitUse over_joints(const JointUse& use, const JointRates& rates) {
  LimitUse out{use.velocity_squared, 0, 0};
  for (size_t j = 0; j < static_cast<size_t>(rates.count); ++j) {
    out.acceleration = std::max<double>(out.acceleration, use.acceleration[j]);
    out.jerk = std::max<double>(out.jerk, use.jerk[j]);
  }
  return out;
}

}  // namespace

TRN_VECTOR_CLONES LimitUse limit_use(const LawSegment& segment, GridInterval& interval,
                                     const JointRates& rates) {
  const auto& samples = interval.samples;
  auto& rows = interval.rows;
  for (size_t i = rows.size(); i < samples.size(); ++i) rows.push_back(judge_row(samples[i], rates));
  JointUse use;
  const double s_end = segment.end().s, rounding = 1e-9 * (s_end - segment.from.s);
  const auto moment = [&](double s) {
    if (s >= s_end - rounding) return segment.duration_s;
    return s > segment.from.s + rounding ? segment.time_at(s, kJudged) : 0;
  };
  for (size_t i = 0; i < samples.size(); ++i) {
    const double s = samples[i].s;
    if (s >= segment.from.s - rounding && s <= s_end + rounding)
      use_row(rows[i], segment.at(moment(s)), segment.jerk, use);
    if (i + 1 == samples.size() || samples[i + 1].s <= s) continue;
    const size_t first = i > 0 && samples[i - 1].s < s ? i - 1 : i;
    if (first + 2 >= samples.size() || samples[first + 2].s <= samples[first + 1].s) continue;
    for (const double u : {0.25, 0.5, 0.75}) {
      const double at = s + u * (samples[i + 1].s - s);
      if (at < segment.from.s - rounding || at > s_end + rounding) continue;
      JudgeRow row;
      row_between(&samples[first], &rows[first], at, row);
      use_row(row, segment.at(moment(at)), segment.jerk, use);
    }
  }
  return over_joints(use, rates);
}

double rest_bound(const std::deque<GridInterval>& grid, size_t first, size_t last, const JointRates& rates,
                  const std::deque<Headroom>& headroom, bool start) {
  const double s0 = grid[first].s, length = grid[last - 1].s + grid[last - 1].h - s0;
  LawSegment unit = rest_start(grid, first, last, 1);
  if (!start) unit = rest_stop(grid, first, last, {s0, 1, 0});
  double b = 1e12;
  for (size_t k = first; k < last; ++k) {
    for (const PathSample& p : grid[k].samples) {
      const double t = unit.time_at(std::clamp(p.s, s0, s0 + length));
      JointUse at;
      use_row(judge_row(p, rates), unit.at(t), unit.jerk, at);
      const LimitUse use = over_joints(at, rates);
      if (use.velocity_squared > 0) b = std::min(b, headroom[k].velocity / use.velocity_squared);
      if (use.acceleration > 0) b = std::min(b, headroom[k].acceleration / use.acceleration);
      if (use.jerk > 0) b = std::min(b, std::cbrt(std::pow(headroom[k].jerk / use.jerk, 2)));
    }
  }
  return b;
}

}  // namespace trn::speed
