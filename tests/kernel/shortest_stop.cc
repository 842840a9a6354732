#include "tests/kernel/shortest_stop.h"

#include <limits>

namespace trn {

namespace {
constexpr double kNever = std::numeric_limits<double>::infinity();
constexpr double kBend = 6;         // of the slope's axis: nodes are closer around 0
constexpr double kLastRate = 0.2;   // below, the joints' motion counts as that of one place
constexpr double kLastWayS = 3e-3;  // of plan time, at most, on that last stretch
constexpr double kPushMax = 4e4;    // of r'', where hardly anything moves
}  // namespace

ShortestStop::ShortestStop(const PlannedMotion& motion, double plan_time_s, double reach_s, const Grid& grid)
    : grid_(grid), joints_(motion.joints()) {
  rate_width_ = (grid_.rate_max - grid_.rate_min) / (grid_.rates - 1);
  slopes_down_ = static_cast<int>(grid_.slopes / 1.6);
  slope_width_ = 1.0 / slopes_down_;
  sample(motion, plan_time_s, reach_s);
  solve();
}

void ShortestStop::sample(const PlannedMotion& motion, double plan_time_s, double reach_s) {
  const double h = grid_.step_s, rest_s = motion.rest_after(plan_time_s);
  rests_ = rest_s - plan_time_s <= reach_s;
  const double reach = std::min(reach_s, rest_s - plan_time_s);
  const int steps = std::max(1, static_cast<int>(reach / h));
  std::vector<JointVec> q;
  for (int i = -1; i <= steps + 2; ++i) q.push_back(motion.q(plan_time_s + i * h));
  for (std::size_t i = 1; i <= static_cast<std::size_t>(steps); ++i) {
    Row row;
    row.v = (q[i + 1] - q[i]) / h;
    row.a = (q[i + 2] - q[i + 1] - q[i] + q[i - 1]) / (2 * h * h);
    row.j = (q[i + 2] - 3 * q[i + 1] + 3 * q[i] - q[i - 1]) / (h * h * h);
    row.v_end = (q[i + 2] - q[i]) / (2 * h);
    row.a_end = (q[i + 2] - 2 * q[i + 1] + q[i]) / (h * h);
    rows_.push_back(row);
  }
}

double ShortestStop::slope_at(int n) const {
  return grid_.slope_max * std::sinh(kBend * slope_width_ * (n - slopes_down_)) / std::sinh(kBend);
}

double ShortestStop::slope_index(double slope) const {
  return slopes_down_ + std::asinh(slope * std::sinh(kBend) / grid_.slope_max) / (kBend * slope_width_);
}

ShortestStop::State ShortestStop::go(double rate, double slope, double c) const {
  const double h = grid_.step_s, b = rate * rate + h * (2 * slope + h * c);
  if (b < 0) return {-1, 0, kNever};
  const double end = std::sqrt(b);
  return {end, slope + h * c, 2 * h / (rate + end)};
}

// What the joints leave to c in a step. Two conditions are linear in c once b is.
ShortestStop::Range ShortestStop::pushes(int step, double rate, double slope) const {
  const Row& row = rows_[static_cast<std::size_t>(step)];
  const double h = grid_.step_s, b = rate * rate;
  Range out{-kPushMax / rate, kPushMax / rate};
  const auto narrow = [&](double held, double gain, double limit) {
    if (std::abs(gain) < 1e-12) return;
    const double one = (-limit - held) / gain, other = (limit - held) / gain;
    out.low = std::max(out.low, std::min(one, other));
    out.high = std::min(out.high, std::max(one, other));
  };
  const double b_mid = std::max(0.0, b + slope * h);
  const double r_mid = std::max(std::sqrt(b_mid), 0.5 * rate);
  for (std::size_t k = 0; k < joints_.size(); ++k) {
    const auto i = static_cast<Eigen::Index>(k);
    const JointLimit& limit = joints_[k].limit;
    narrow(row.j[i] * b_mid + 3 * row.a[i] * slope, row.v[i] + 1.5 * h * row.a[i], limit.jerk / r_mid);
    narrow(row.a_end[i] * (b + 2 * h * slope) + row.v_end[i] * slope, h * h * row.a_end[i] + h * row.v_end[i],
           limit.acceleration);
    const double fastest = limit.velocity / std::max(std::abs(row.v_end[i]), 1e-12);
    if (fastest < 1.1 * grid_.rate_max)
      out.high = std::min(out.high, (fastest * fastest - b - 2 * h * slope) / (h * h));
  }
  // Staying as planned is legal whatever rounding says.
  if (slope == 0 && rate <= 1) out = {std::min(out.low, 0.0), std::max(out.high, 0.0)};
  return out;
}

// From a low rate to rest: the strongest push down, then up, at one place.
double ShortestStop::last_stretch(int step, double rate, double slope) const {
  if (rate > kLastRate || rate < 0) return kNever;
  const auto first = static_cast<std::size_t>(step);
  const std::size_t last =
      std::min(rows_.size(), first + static_cast<std::size_t>(kLastWayS / grid_.step_s) + 1);
  double peak = std::abs(slope), push = 0;
  for (int round = 0; round < 4; ++round) {
    push = kPushMax;
    for (std::size_t n = std::min(first, last - 1); n < last; ++n)
      for (std::size_t k = 0; k < joints_.size(); ++k) {
        const auto i = static_cast<Eigen::Index>(k);
        const Row& row = rows_[n];
        const JointLimit& limit = joints_[k].limit;
        const double v = std::max(std::abs(row.v[i]), 1e-12), a = std::abs(row.a[i]), r = rate;
        if (a * r * r + v * peak > limit.acceleration) return kNever;
        push = std::min(push, (limit.jerk - std::abs(row.j[i]) * r * r * r - 3 * r * peak * a) / v);
      }
    if (push <= 0 || (slope < 0 && slope * slope > 2 * push * rate)) return kNever;
    peak = std::sqrt(push * rate + slope * slope / 2);
  }
  const double time = (2 * peak + slope) / push;
  return time * rate <= kLastWayS ? time : kNever;
}

double ShortestStop::at(int step, double rate, double slope) const {
  if (rate < 0) return kNever;
  if (static_cast<std::size_t>(step) == rows_.size()) return rests_ ? 0 : last_stretch(step - 1, rate, slope);
  if (rate < grid_.rate_min) return last_stretch(step, rate, slope);
  const double x = (rate - grid_.rate_min) / rate_width_, y = slope_index(slope);
  if (y < 0 || y > grid_.slopes - 1 || x > grid_.rates - 1) return kNever;
  const int m = std::min(static_cast<int>(x), grid_.rates - 2),
            n = std::min(static_cast<int>(y), grid_.slopes - 2);
  const double fx = x - m, fy = y - n;
  const float* v = &value_[static_cast<std::size_t>(step)][static_cast<std::size_t>(m * grid_.slopes + n)];
  const double corners[4] = {v[0], v[1], v[grid_.slopes], v[grid_.slopes + 1]};
  const double weights[4] = {(1 - fx) * (1 - fy), (1 - fx) * fy, fx * (1 - fy), fx * fy};
  double sum = 0;
  for (int k = 0; k < 4; ++k)
    if (weights[k] > 1e-9) sum += weights[k] * corners[k];
  return sum;
}

double ShortestStop::best(int step, double rate, double slope, int tries, double* c_best) const {
  double least = last_stretch(step, rate, slope);
  if (c_best) *c_best = kNever;
  const Range range = pushes(step, rate, slope);
  if (range.low > range.high) return least;
  const auto try_it = [&](double c) {
    const State next = go(rate, slope, c);
    if (next.rate < 0) return;
    const double time = next.time_s + at(step + 1, next.rate, next.slope);
    if (time >= least) return;
    least = time;
    if (c_best) *c_best = c;
  };
  for (int k = 0; k < tries; ++k) try_it(range.low + (range.high - range.low) * k / (tries - 1));
  if (range.low < 0 && range.high > 0) try_it(0);
  const double level = -slope / grid_.step_s;  // w becomes 0
  if (level >= range.low && level <= range.high) try_it(level);
  return least;
}

void ShortestStop::solve() {
  value_.assign(rows_.size(), {});
  for (int step = static_cast<int>(rows_.size()) - 1; step >= 0; --step) {
    auto& values = value_[static_cast<std::size_t>(step)];
    values.resize(static_cast<std::size_t>(grid_.rates * grid_.slopes));
    for (int m = 0; m < grid_.rates; ++m)
      for (int n = 0; n < grid_.slopes; ++n)
        values[static_cast<std::size_t>(m * grid_.slopes + n)] =
            static_cast<float>(best(step, rate_at(m), slope_at(n), grid_.pushes, nullptr));
  }
}

double ShortestStop::driven(double rate, double slope) const {
  double time = 0;
  for (int step = 0; step < static_cast<int>(rows_.size()); ++step) {
    double c = kNever;
    const double rest = best(step, rate, slope, 201, &c);
    if (c == kNever) return time + rest;
    const State next = go(rate, slope, c);
    time += next.time_s;
    rate = next.rate;
    slope = next.slope;
  }
  return rests_ ? time : kNever;
}

}  // namespace trn
