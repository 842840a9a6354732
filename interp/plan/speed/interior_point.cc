#include "interp/plan/speed/interior_point.h"

#include <algorithm>
#include <cmath>

namespace trn::speed {

namespace {

constexpr double kToBoundary = 0.99;  // share of the way to the nearest boundary that a step may go
constexpr double kMuCut = 0.15;

double dual_change(double slack, double dual, double slack_change, double mu) {
  return (mu - dual * slack_change) / slack - dual;
}

}  // namespace

InteriorPointResult InteriorPoint::solve(const SpeedProblem& problem, const InteriorPointOptions& options,
                                         Doubles& c) {
  p_ = &problem;
  begin(c, options.start_use);
  InteriorPointResult result;
  double mu = options.start_mu * total_time() / static_cast<double>(n_);
  for (Doubles* dual : {&bound_dual_, &acc_dual_up_, &acc_dual_low_, &jerk_dual_up_, &jerk_dual_low_})
    dual->clear();
  const auto duals = [&](const Doubles& slack, Doubles& dual) {
    dual.resize(slack.size());
    for (size_t i = 0; i < slack.size(); ++i) dual[i] = mu / slack[i];
  };
  duals(bound_slack_, bound_dual_);
  duals(acc_up_, acc_dual_up_);
  duals(acc_low_, acc_dual_low_);
  duals(jerk_up_, jerk_dual_up_);
  duals(jerk_low_, jerk_dual_low_);
  for (; result.iterations < options.iterations_max; ++result.iterations) {
    assemble(mu);
    if (!factor_and_solve()) break;
    row_steps();
    const double alpha = primal_step(), alpha_dual = dual_step(mu);
    advance(mu, alpha, alpha_dual);
    const double g = gap();
    if (getenv("V"))
      fprintf(stderr, "  it %d a %.3f ad %.3f wid %.3g gap %.3g T %.5g mu %.3g\n", result.iterations, alpha,
              alpha_dual, widening_, g, total_time(), mu);

    if (widening_ == 0 && g < options.gap * total_time() && alpha > 0.3) break;
    const double average = g / static_cast<double>(inequalities_);
    const double quality = std::min(alpha, alpha_dual);
    mu = average * (quality > 0.7 ? kMuCut : quality > 0.3 ? 0.5 : 1.0);
  }
  result.feasible = widening_ == 0;
  result.time_s = total_time();
  c.assign(x_.begin() + 1, x_.end() - 1);
  return result;
}

void InteriorPoint::begin(const Doubles& c, double start_use) {
  n_ = c.size();
  x_.assign(n_ + 2, 0);
  std::copy(c.begin(), c.end(), x_.begin() + 1);
  if (p_->first_fixed) x_[1] = p_->first_c;
  dx_.assign(n_ + 2, 0);
  root_.assign(n_, 0);
  const size_t acc = p_->acc0.size(), jerk = p_->jerk0.size();
  inequalities_ = n_ + 2 * (acc + jerk);
  for (Doubles* v : {&acc_, &acc_up_, &acc_low_, &acc_step_}) v->assign(acc, 0);
  for (Doubles* v : {&jerk_, &jerk_up_, &jerk_low_, &jerk_step_}) v->assign(jerk, 0);
  for (Doubles* v : {&bound_slack_, &bound_step_, &curvature_}) v->assign(n_, 0);
  widening_ = 0;
  acc_wide_.assign(n_ + 1, 0);
  jerk_wide_.assign(n_, 0);
  bound_wide_.assign(n_, 0);
  evaluate();
  widen(start_use);
  evaluate();
}

// Makes room for the start: a row used more than start_use is widened.
void InteriorPoint::widen(double start_use) {
  const auto joints = static_cast<size_t>(p_->joints);
  const auto extra = [&](double use) { return std::max(0.0, use / start_use - 1); };
  for (size_t j = 0; j < joints; ++j)
    for (size_t k = 0; k <= n_; ++k)
      acc_wide_[k] = std::max(acc_wide_[k], extra(std::abs(acc_[j * (n_ + 1) + k])));
  for (size_t r = 0; r < 2 * joints; ++r)
    for (size_t k = 0; k < n_; ++k)
      jerk_wide_[k] = std::max(jerk_wide_[k], extra(std::abs(jerk_[r * n_ + k]) / root_[k]));
  for (size_t k = 0; k < n_; ++k) bound_wide_[k] = extra(x_[k + 1] / p_->c_max[k]);
  for (Doubles* wide : {&acc_wide_, &jerk_wide_, &bound_wide_})
    for (double w : *wide)
      if (w > 0) widening_ = 1;
}

// Values and slacks of all rows at x_.
void InteriorPoint::evaluate() {
  for (size_t k = 0; k < n_; ++k) {
    root_[k] = 1 / std::sqrt(x_[k + 1]);
    bound_slack_[k] = 1 + widening_ * bound_wide_[k] - x_[k + 1] / p_->c_max[k];
  }
  for (size_t j = 0; j < static_cast<size_t>(p_->joints); ++j) {
    const size_t at = j * (n_ + 1);
    const double *a0 = &p_->acc0[at], *a1 = &p_->acc1[at];
    for (size_t k = 0; k <= n_; ++k) {
      const double value = a0[k] * x_[k] + a1[k] * x_[k + 1], room = 1 + widening_ * acc_wide_[k];
      acc_[at + k] = value;
      acc_up_[at + k] = room - value;
      acc_low_[at + k] = room + value;
    }
  }
  for (size_t r = 0; r < 2 * static_cast<size_t>(p_->joints); ++r) {
    const size_t at = r * n_;
    const double *b0 = &p_->jerk0[at], *b1 = &p_->jerk1[at], *b2 = &p_->jerk2[at];
    for (size_t k = 0; k < n_; ++k) {
      const double value = b0[k] * x_[k] + b1[k] * x_[k + 1] + b2[k] * x_[k + 2];
      const double room = (1 + widening_ * jerk_wide_[k]) * root_[k];
      jerk_[at + k] = value;
      jerk_up_[at + k] = room - value;
      jerk_low_[at + k] = room + value;
    }
  }
}

void InteriorPoint::assemble(double mu) {
  diag_.assign(n_ + 2, 0);
  off1_.assign(n_ + 2, 0);
  off2_.assign(n_ + 2, 0);
  rhs_.assign(n_ + 2, 0);
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

void InteriorPoint::add_acceleration(double mu) {
  for (size_t j = 0; j < static_cast<size_t>(p_->joints); ++j) {
    const size_t at = j * (n_ + 1);
    const double *a0 = &p_->acc0[at], *a1 = &p_->acc1[at];
    for (size_t k = 0; k <= n_; ++k) {
      const double up = 1 / acc_up_[at + k], low = 1 / acc_low_[at + k];
      const double wu = acc_dual_up_[at + k] * up, wl = acc_dual_low_[at + k] * low, w = wu + wl;
      const double y = mu * (low - up) + widening_ * acc_wide_[k] * (wl - wu);
      diag_[k] += w * a0[k] * a0[k];
      diag_[k + 1] += w * a1[k] * a1[k];
      off1_[k] += w * a0[k] * a1[k];
      rhs_[k] += y * a0[k];
      rhs_[k + 1] += y * a1[k];
    }
  }
}

// Slack: R(c_k) -+ L with R = 1 / sqrt(c_k); gradient R' e_k -+ B.
void InteriorPoint::add_jerk(double mu) {
  for (size_t r = 0; r < 2 * static_cast<size_t>(p_->joints); ++r) {
    const size_t at = r * n_;
    const double *b0 = &p_->jerk0[at], *b1 = &p_->jerk1[at], *b2 = &p_->jerk2[at];
    for (size_t k = 0; k < n_; ++k) {
      const double up = 1 / jerk_up_[at + k], low = 1 / jerk_low_[at + k];
      const double wide = 1 + widening_ * jerk_wide_[k];
      const double slope = -0.5 * wide * root_[k] / x_[k + 1];
      const double wu = jerk_dual_up_[at + k] * up, wl = jerk_dual_low_[at + k] * low;
      const double gu = slope - b1[k], gl = slope + b1[k], d = wl - wu, w = wu + wl;
      const double taken = (wide - 1) * root_[k], fu = mu * up + taken * wu, fl = mu * low + taken * wl,
                   y = fl - fu;
      diag_[k] += w * b0[k] * b0[k];
      diag_[k + 1] += wu * gu * gu + wl * gl * gl;
      diag_[k + 2] += w * b2[k] * b2[k];
      off1_[k] += b0[k] * (w * b1[k] + d * slope);
      off1_[k + 1] += b2[k] * (w * b1[k] + d * slope);
      off2_[k] += w * b0[k] * b2[k];
      rhs_[k] += y * b0[k];
      rhs_[k + 1] += fu * gu + fl * gl;
      rhs_[k + 2] += y * b2[k];
      curvature_[k] -= wide * (jerk_dual_up_[at + k] + jerk_dual_low_[at + k]);
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

// Changes of the linear forms along dx_; those of the slacks follow from them.
void InteriorPoint::row_steps() {
  for (size_t j = 0; j < static_cast<size_t>(p_->joints); ++j) {
    const size_t at = j * (n_ + 1);
    for (size_t k = 0; k <= n_; ++k)
      acc_step_[at + k] = p_->acc0[at + k] * dx_[k] + p_->acc1[at + k] * dx_[k + 1];
  }
  for (size_t r = 0; r < 2 * static_cast<size_t>(p_->joints); ++r) {
    const size_t at = r * n_;
    for (size_t k = 0; k < n_; ++k)
      jerk_step_[at + k] =
          p_->jerk0[at + k] * dx_[k] + p_->jerk1[at + k] * dx_[k + 1] + p_->jerk2[at + k] * dx_[k + 2];
  }
}

// Calls visit(slack, dual, change of slack along dx_ with the widening taken back) for every inequality.
template <typename Visit>
void InteriorPoint::for_each_row(Visit visit) {
  for (size_t k = p_->first_fixed ? 1 : 0; k < n_; ++k)
    visit(bound_slack_[k], bound_dual_[k], -dx_[k + 1] / p_->c_max[k] - widening_ * bound_wide_[k]);
  for (size_t j = 0; j < static_cast<size_t>(p_->joints); ++j)
    for (size_t k = 0; k <= n_; ++k) {
      const size_t i = j * (n_ + 1) + k;
      const double taken = widening_ * acc_wide_[k];
      visit(acc_up_[i], acc_dual_up_[i], -acc_step_[i] - taken);
      visit(acc_low_[i], acc_dual_low_[i], acc_step_[i] - taken);
    }
  for (size_t r = 0; r < 2 * static_cast<size_t>(p_->joints); ++r)
    for (size_t k = 0; k < n_; ++k) {
      const size_t i = r * n_ + k;
      const double taken = widening_ * jerk_wide_[k];
      const double right = root_[k] * (-0.5 * (1 + taken) / x_[k + 1] * dx_[k + 1] - taken);
      visit(jerk_up_[i], jerk_dual_up_[i], right - jerk_step_[i]);
      visit(jerk_low_[i], jerk_dual_low_[i], right + jerk_step_[i]);
    }
}

double InteriorPoint::primal_step() {
  double worst = kToBoundary;  // share of a slack that a full step eats
  for_each_row([&](double slack, double, double change) { worst = std::max(worst, -change / slack); });
  for (size_t k = 1; k <= n_; ++k) {
    worst = std::max(worst, -dx_[k] / x_[k] / 0.7);
    worst = std::max(worst, dx_[k] / x_[k] / 4.0);
  }
  return kToBoundary / worst;
}

double InteriorPoint::dual_step(double mu) {
  double worst = kToBoundary;
  for_each_row([&](double slack, double dual, double change) {
    worst = std::max(worst, -dual_change(slack, dual, change, mu) / dual);
  });
  return kToBoundary / worst;
}

void InteriorPoint::advance(double mu, double alpha, double alpha_dual) {
  for_each_row([&](double slack, double& dual, double change) {
    dual += alpha_dual * dual_change(slack, dual, change, mu);
  });
  const double widening = widening_;
  for (size_t k = 1; k <= n_; ++k) x_[k] += alpha * dx_[k];
  for (int i = 0; i < 30; ++i) {  // the product of widening and 1 / sqrt(c) may fall below its linearisation
    widening_ = widening * (1 - alpha);
    evaluate();
    if (inside()) break;
    for (size_t k = 1; k <= n_; ++k) x_[k] -= 0.4 * alpha * dx_[k];
    alpha *= 0.6;
  }
}

bool InteriorPoint::inside() const {
  double least = 1;
  for (const Doubles* slacks : {&bound_slack_, &acc_up_, &acc_low_, &jerk_up_, &jerk_low_})
    for (double slack : *slacks) least = std::min(least, slack);
  return least > 0;
}

double InteriorPoint::gap() {
  double sum = 0;
  for_each_row([&](double slack, double dual, double) { sum += slack * dual; });
  return sum;
}

double InteriorPoint::total_time() const {
  double sum = 0;
  for (size_t k = 0; k < n_; ++k) sum += p_->h[k] * root_[k];
  return sum;
}

}  // namespace trn::speed
