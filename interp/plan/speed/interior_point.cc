#include "interp/plan/speed/interior_point.h"

#include <algorithm>
#include <cmath>

namespace trn::speed {

namespace {

constexpr double kToBoundary = 0.99;  // share of the way to the nearest boundary that a step may go
constexpr double kMuCut = 0.15;

double largest(const Doubles& v) { return *std::max_element(v.begin(), v.end()); }

}  // namespace

void InteriorPoint::Rows::resize(size_t row_count, size_t place_count) {
  rows = row_count;
  places = place_count;
  for (Doubles* v : {&value, &step}) v->assign(rows * places, 0);
  for (auto* sides : {&slack, &inverse, &dual, &dual_step})
    for (Doubles& v : *sides) v.assign(rows * places, 0);
}

InteriorPointResult InteriorPoint::solve(const SpeedProblem& problem, const InteriorPointOptions& options,
                                         Doubles& c) {
  p_ = &problem;
  begin(c, options);
  InteriorPointResult result;
  double mu = options.start_mu * total_time() / static_cast<double>(n_);
  start_duals(mu);
  for (; result.iterations < options.iterations_max; ++result.iterations) {
    assemble(mu);
    if (!factor_and_solve()) break;
    find_steps(mu);
    const double alpha = primal_step(), alpha_dual = dual_step();
    advance(alpha, alpha_dual);
    const double g = gap();
    if (widening_ == 0 && g < options.gap * total_time() && alpha > 0.3) break;
    const double quality = std::min(alpha, alpha_dual);
    mu = g / static_cast<double>(inequalities_) * (quality > 0.7 ? kMuCut : quality > 0.3 ? 0.5 : 1.0);
  }
  result.feasible = widening_ == 0;
  result.time_s = total_time();
  c.assign(x_.begin() + 1, x_.end() - 1);
  return result;
}

void InteriorPoint::begin(const Doubles& c, const InteriorPointOptions& options) {
  n_ = c.size();
  x_.assign(n_ + 2, 0);
  std::copy(c.begin(), c.end(), x_.begin() + 1);
  if (p_->first_fixed) x_[1] = p_->first_c;
  dx_.assign(n_ + 2, 0);
  const auto joints = static_cast<size_t>(p_->joints);
  acc_.resize(joints, n_ + 1);
  jerk_.resize(2 * joints, n_);
  inequalities_ = n_ + 2 * (acc_.value.size() + jerk_.value.size());
  for (Doubles* v : {&acc_wide_, &acc_room_, &worst_acc_, &worst_acc_dual_, &sums_}) v->assign(n_ + 1, 0);
  for (Doubles* v : {&root_, &bound_slack_, &bound_dual_step_, &curvature_, &jerk_wide_, &bound_wide_,
                     &jerk_room_, &worst_jerk_, &worst_jerk_dual_})
    v->assign(n_, 0);
  widening_ = 0;
  evaluate();
  widen(options.start_use);
  evaluate();
}

// Makes room for the start: a row used more than start_use is widened.
void InteriorPoint::widen(double start_use) {
  const auto extra = [&](double use) { return std::max(0.0, use / start_use - 1); };
  for (size_t r = 0; r < acc_.rows; ++r)
    for (size_t k = 0; k <= n_; ++k)
      acc_wide_[k] = std::max(acc_wide_[k], extra(std::abs(acc_.value[r * (n_ + 1) + k])));
  for (size_t r = 0; r < jerk_.rows; ++r)
    for (size_t k = 0; k < n_; ++k)
      jerk_wide_[k] = std::max(jerk_wide_[k], extra(std::abs(jerk_.value[r * n_ + k]) / root_[k]));
  for (size_t k = 0; k < n_; ++k) bound_wide_[k] = extra(x_[k + 1] / p_->c_max[k]);
  if (largest(acc_wide_) > 0 || largest(jerk_wide_) > 0 || largest(bound_wide_) > 0) widening_ = 1;
}

void InteriorPoint::start_duals(double mu) {
  bound_dual_.assign(n_, 0);
  for (size_t k = p_->first_fixed ? 1 : 0; k < n_; ++k) bound_dual_[k] = mu / bound_slack_[k];
  for (Rows* rows : {&acc_, &jerk_})
    for (size_t side : {size_t{0}, size_t{1}})
      for (size_t i = 0; i < rows->value.size(); ++i) rows->dual[side][i] = mu * rows->inverse[side][i];
}

// Values and slacks of all rows at x_. False: not strictly inside.
bool InteriorPoint::evaluate() {
  double least = 1;
  for (size_t k = 0; k < n_; ++k) {
    root_[k] = 1 / std::sqrt(x_[k + 1]);
    jerk_room_[k] = (1 + widening_ * jerk_wide_[k]) * root_[k];
    bound_slack_[k] = 1 + widening_ * bound_wide_[k] - x_[k + 1] / p_->c_max[k];
    least = std::min(least, bound_slack_[k]);
  }
  for (size_t k = 0; k <= n_; ++k) acc_room_[k] = 1 + widening_ * acc_wide_[k];
  const double* __restrict x = x_.data();
  for (size_t r = 0; r < acc_.rows; ++r) {
    const double* __restrict a0 = &p_->acc0[r * (n_ + 1)], * __restrict a1 = &p_->acc1[r * (n_ + 1)];
    double* __restrict value = &acc_.value[r * (n_ + 1)];
    for (size_t k = 0; k <= n_; ++k) value[k] = a0[k] * x[k] + a1[k] * x[k + 1];
  }
  for (size_t r = 0; r < jerk_.rows; ++r) {
    const double* __restrict b0 = &p_->jerk0[r * n_], * __restrict b1 = &p_->jerk1[r * n_], * __restrict b2 = &p_->jerk2[r * n_];
    double* __restrict value = &jerk_.value[r * n_];
    for (size_t k = 0; k < n_; ++k) value[k] = b0[k] * x[k] + b1[k] * x[k + 1] + b2[k] * x[k + 2];
  }
  const bool acc_inside = evaluate_rows(acc_, acc_room_), jerk_inside = evaluate_rows(jerk_, jerk_room_);
  return least > 0 && acc_inside && jerk_inside;
}

bool InteriorPoint::evaluate_rows(Rows& rows, const Doubles& room) {
  const size_t n = rows.places;
  double* __restrict least = sums_.data();
  std::fill(sums_.begin(), sums_.end(), 1.0);
  for (size_t r = 0; r < rows.rows; ++r) {
    const double* __restrict value = &rows.value[r * n], * __restrict wide = room.data();
    double* __restrict up = &rows.slack[0][r * n], * __restrict low = &rows.slack[1][r * n];
    double* __restrict inv_up = &rows.inverse[0][r * n], * __restrict inv_low = &rows.inverse[1][r * n];
    for (size_t k = 0; k < n; ++k) {
      const double u = wide[k] - value[k], l = wide[k] + value[k], m = u < l ? u : l;
      up[k] = u;
      low[k] = l;
      inv_up[k] = 1 / u;
      inv_low[k] = 1 / l;
      least[k] = m < least[k] ? m : least[k];
    }
  }
  return *std::min_element(sums_.begin(), sums_.end()) > 0;
}

void InteriorPoint::assemble(double mu) {
  for (Doubles* v : {&diag_, &off1_, &off2_, &rhs_}) v->assign(n_ + 2, 0);
  for (size_t k = 0; k < n_; ++k) curvature_[k] = p_->h[k];
  add_bounds(mu);
  add_acceleration(mu);
  add_jerk(mu);
  for (size_t k = 0; k < n_; ++k) {
    const double cube = root_[k] / x_[k + 1];
    rhs_[k + 1] += 0.5 * p_->h[k] * cube;
    diag_[k + 1] += 0.75 * std::max(curvature_[k], 1e-3 * p_->h[k]) * cube / x_[k + 1];
  }
}

void InteriorPoint::add_bounds(double mu) {
  for (size_t k = 0; k < n_; ++k) {
    const double i = 1 / (bound_slack_[k] * p_->c_max[k]);
    rhs_[k + 1] -= (mu + bound_dual_[k] * widening_ * bound_wide_[k]) * i;
    diag_[k + 1] += bound_dual_[k] * i / p_->c_max[k];
  }
}

// Each matrix band in a loop of its own: no loop writes what its next pass reads.
void InteriorPoint::add_acceleration(double mu) {
  for (size_t r = 0; r < acc_.rows; ++r) {
    const size_t at = r * (n_ + 1);
    const double* __restrict a0 = &p_->acc0[at], * __restrict a1 = &p_->acc1[at];
    const double* __restrict up = &acc_.inverse[0][at], * __restrict low = &acc_.inverse[1][at];
    const double* __restrict du = &acc_.dual[0][at], * __restrict dl = &acc_.dual[1][at];
    const double* __restrict wide = acc_wide_.data();
    double* __restrict w = &acc_.dual_step[0][at], * __restrict y =
                                                       &acc_.dual_step[1][at];  // scratch until find_steps
    for (size_t k = 0; k <= n_; ++k) {
      const double wu = du[k] * up[k], wl = dl[k] * low[k];
      w[k] = wu + wl;
      y[k] = mu * (low[k] - up[k]) + widening_ * wide[k] * (wl - wu);
    }
    double* __restrict diag = diag_.data(), * __restrict off1 = off1_.data(), * __restrict rhs = rhs_.data();
    for (size_t k = 0; k <= n_; ++k) {
      diag[k] += w[k] * a0[k] * a0[k];
      off1[k] += w[k] * a0[k] * a1[k];
      rhs[k] += y[k] * a0[k];
    }
    for (size_t k = 0; k <= n_; ++k) {
      diag[k + 1] += w[k] * a1[k] * a1[k];
      rhs[k + 1] += y[k] * a1[k];
    }
  }
}

// Slack: R(c_k) -+ L with R = 1 / sqrt(c_k); gradient R' e_k -+ B.
void InteriorPoint::add_jerk(double mu) {
  for (size_t r = 0; r < jerk_.rows; ++r) {
    const size_t at = r * n_;
    const double* __restrict b0 = &p_->jerk0[at], * __restrict b1 = &p_->jerk1[at], * __restrict b2 = &p_->jerk2[at];
    const double* __restrict up = &jerk_.inverse[0][at], * __restrict low = &jerk_.inverse[1][at];
    const double* __restrict du = &jerk_.dual[0][at], * __restrict dl = &jerk_.dual[1][at];
    const double* __restrict root = root_.data(), * __restrict room = jerk_room_.data(), * __restrict x = x_.data();
    double* __restrict y = &jerk_.dual_step[0][at], * __restrict mixed = &jerk_.dual_step[1][at];  // scratch
    double* __restrict w = &jerk_.step[at], * __restrict curvature = curvature_.data();
    double* __restrict diag = diag_.data(), * __restrict off1 = off1_.data(), * __restrict off2 = off2_.data();
    double* __restrict rhs = rhs_.data();
    for (size_t k = 0; k < n_; ++k) {
      const double slope = -0.5 * room[k] / x[k + 1], taken = room[k] - root[k];
      const double wu = du[k] * up[k], wl = dl[k] * low[k], d = wl - wu;
      const double gu = slope - b1[k], gl = slope + b1[k];
      const double fu = mu * up[k] + taken * wu, fl = mu * low[k] + taken * wl;
      w[k] = wu + wl;
      mixed[k] = w[k] * b1[k] + d * slope;
      y[k] = fl - fu;
      diag[k + 1] += wu * gu * gu + wl * gl * gl;
      rhs[k + 1] += fu * gu + fl * gl;
      curvature[k] -= room[k] / root[k] * (du[k] + dl[k]);
    }
    for (size_t k = 0; k < n_; ++k) {
      diag[k] += w[k] * b0[k] * b0[k];
      off1[k] += b0[k] * mixed[k];
      off2[k] += w[k] * b0[k] * b2[k];
      rhs[k] += y[k] * b0[k];
    }
    for (size_t k = 0; k < n_; ++k) {
      diag[k + 2] += w[k] * b2[k] * b2[k];
      off1[k + 1] += b2[k] * mixed[k];
      rhs[k + 2] += y[k] * b2[k];
    }
  }
}

// L D L^T of the pentadiagonal matrix, in place; entries 1..n are the unknowns.
bool InteriorPoint::factor_and_solve() {
  const size_t first = p_->first_fixed ? 2 : 1;
  dx_.assign(n_ + 2, 0);
  double l1 = 0, l2 = 0, l2_next = 0, y1 = 0, y2 = 0;  // of the rows before
  for (size_t i = first; i <= n_; ++i) {
    const double d = diag_[i];
    if (!(d > 0) || !std::isfinite(d)) return false;
    const double y = rhs_[i] - l1 * y1 - l2 * y2;
    const double e1 = i + 1 <= n_ ? off1_[i] : 0, e2 = i + 2 <= n_ ? off2_[i] : 0;
    const double f1 = e1 / d, f2 = e2 / d;
    if (i + 1 <= n_) diag_[i + 1] -= f1 * e1;
    if (i + 2 <= n_) {
      off1_[i + 1] -= f1 * e2;
      diag_[i + 2] -= f2 * e2;
    }
    off1_[i] = f1;
    off2_[i] = f2;
    dx_[i] = y / d;
    l2 = l2_next;
    l2_next = f2;
    l1 = f1;
    y2 = y1;
    y1 = y;
  }
  for (size_t i = n_; i >= first; --i) {
    if (i + 1 <= n_) dx_[i] -= off1_[i] * dx_[i + 1];
    if (i + 2 <= n_) dx_[i] -= off2_[i] * dx_[i + 2];
  }
  return true;
}

// Changes of all rows and multipliers along dx_, the widening taken back in full.
void InteriorPoint::find_steps(double mu) {
  const double* __restrict dx = dx_.data();
  for (size_t r = 0; r < acc_.rows; ++r) {
    const double* __restrict a0 = &p_->acc0[r * (n_ + 1)], * __restrict a1 = &p_->acc1[r * (n_ + 1)];
    double* __restrict step = &acc_.step[r * (n_ + 1)];
    for (size_t k = 0; k <= n_; ++k) step[k] = a0[k] * dx[k] + a1[k] * dx[k + 1];
  }
  for (size_t r = 0; r < jerk_.rows; ++r) {
    const double* __restrict b0 = &p_->jerk0[r * n_], * __restrict b1 = &p_->jerk1[r * n_], * __restrict b2 = &p_->jerk2[r * n_];
    double* __restrict step = &jerk_.step[r * n_];
    for (size_t k = 0; k < n_; ++k) step[k] = b0[k] * dx[k] + b1[k] * dx[k + 1] + b2[k] * dx[k + 2];
  }
  for (size_t k = 0; k <= n_; ++k) sums_[k] = -widening_ * acc_wide_[k];
  row_steps(acc_, sums_, mu, worst_acc_, worst_acc_dual_);
  for (size_t k = 0; k < n_; ++k)
    sums_[k] = -0.5 * jerk_room_[k] / x_[k + 1] * dx_[k + 1] - (jerk_room_[k] - root_[k]);
  row_steps(jerk_, sums_, mu, worst_jerk_, worst_jerk_dual_);
  for (size_t k = p_->first_fixed ? 1 : 0; k < n_; ++k) {
    const double change = -dx_[k + 1] / p_->c_max[k] - widening_ * bound_wide_[k];
    bound_dual_step_[k] = (mu - bound_dual_[k] * change) / bound_slack_[k] - bound_dual_[k];
    worst_acc_[k] = std::max(worst_acc_[k], -change / bound_slack_[k]);
    worst_acc_dual_[k] = std::max(worst_acc_dual_[k], -bound_dual_step_[k] / bound_dual_[k]);
  }
}

// worst: greatest share of a slack (multiplier) that the full step eats, by place.
void InteriorPoint::row_steps(Rows& rows, const Doubles& room_change, double mu, Doubles& worst,
                              Doubles& worst_dual) {
  const size_t n = rows.places;
  std::fill(worst.begin(), worst.end(), 0.0);
  std::fill(worst_dual.begin(), worst_dual.end(), 0.0);
  const double* __restrict right = room_change.data();
  double* __restrict eaten = worst.data(), * __restrict eaten_dual = worst_dual.data();
  for (size_t r = 0; r < rows.rows; ++r)
    for (const size_t side : {size_t{0}, size_t{1}}) {
      const double sign = side == 0 ? -1 : 1;
      const double* __restrict step = &rows.step[r * n], * __restrict inverse = &rows.inverse[side][r * n];
      const double* __restrict dual = &rows.dual[side][r * n];
      double* __restrict dual_step = &rows.dual_step[side][r * n];
      for (size_t k = 0; k < n; ++k) {
        const double share = (right[k] + sign * step[k]) * inverse[k];
        const double change = mu * inverse[k] - dual[k] * share - dual[k], part = -change / dual[k];
        dual_step[k] = change;
        eaten[k] = eaten[k] < -share ? -share : eaten[k];
        eaten_dual[k] = eaten_dual[k] < part ? part : eaten_dual[k];
      }
    }
}

double InteriorPoint::primal_step() const {
  double worst = std::max({kToBoundary, largest(worst_acc_), largest(worst_jerk_)});
  for (size_t k = 1; k <= n_; ++k) {
    const double growth = dx_[k] / x_[k];
    worst = std::max({worst, -growth / 0.7, growth / 4.0});
  }
  return kToBoundary / worst;
}

double InteriorPoint::dual_step() const {
  return kToBoundary / std::max({kToBoundary, largest(worst_acc_dual_), largest(worst_jerk_dual_)});
}

void InteriorPoint::advance(double alpha, double alpha_dual) {
  for (size_t k = 0; k < n_; ++k) bound_dual_[k] += alpha_dual * bound_dual_step_[k];
  for (Rows* rows : {&acc_, &jerk_})
    for (const size_t side : {size_t{0}, size_t{1}}) {
      double* __restrict dual = rows->dual[side].data();
      const double* __restrict step = rows->dual_step[side].data();
      for (size_t i = 0; i < rows->value.size(); ++i) dual[i] += alpha_dual * step[i];
    }
  const double widening = widening_;
  for (size_t k = 1; k <= n_; ++k) x_[k] += alpha * dx_[k];
  for (int i = 0; i < 30; ++i) {  // the product of widening and 1 / sqrt(c) may fall below its linearisation
    widening_ = widening * (1 - alpha);
    if (evaluate()) break;
    for (size_t k = 1; k <= n_; ++k) x_[k] -= 0.4 * alpha * dx_[k];
    alpha *= 0.6;
  }
}

double InteriorPoint::gap() {
  double total = 0;
  for (size_t k = 0; k < n_; ++k) total += bound_slack_[k] * bound_dual_[k];
  double* __restrict sums = sums_.data();
  for (Rows* rows : {&acc_, &jerk_}) {
    std::fill(sums_.begin(), sums_.end(), 0.0);
    for (size_t r = 0; r < rows->rows; ++r)
      for (const size_t side : {size_t{0}, size_t{1}}) {
        const double* __restrict slack = &rows->slack[side][r * rows->places], * __restrict dual =
                                                                                   &rows->dual[side]
                                                                                              [r *
                                                                                               rows->places];
        for (size_t k = 0; k < rows->places; ++k) sums[k] += slack[k] * dual[k];
      }
    for (double s : sums_) total += s;
  }
  return total;
}

double InteriorPoint::total_time() const {
  double sum = 0;
  for (size_t k = 0; k < n_; ++k) sum += p_->h[k] * root_[k];
  return sum;
}

}  // namespace trn::speed
