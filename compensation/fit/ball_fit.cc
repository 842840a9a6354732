#include "compensation/fit/ball_fit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "compensation/fit/least_squares.h"
#include "compensation/fit/rotary_fit.h"

namespace trn {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Index = Eigen::Index;

constexpr double kPrior = 1;  // mm, of a plan
constexpr int kStepsMax = 30;
constexpr double kConverged = 1e-10;  // mm

double unit_of(const BallParameter& p) { return p.kind == BallParameter::Kind::kTilt ? 1 / kTiltArm_mm : 1; }
bool is_error(const BallParameter& p) {
  return p.kind == BallParameter::Kind::kOffset || p.kind == BallParameter::Kind::kTilt;
}
std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// The machine, the ball and the stylus as a set of parameters says.
struct Guess {
  Guess(const ActualChain& known, const std::vector<BallParameter>& parameters) : chain(known) {
    for (const BallParameter& p : parameters) {
      if (p.kind == BallParameter::Kind::kBall) ball_B[p.component] = p.value;
      if (p.kind == BallParameter::Kind::kRadius) reach_mm = p.value;
      if (p.kind == BallParameter::Kind::kStylus) stylus_S[p.component] = p.value;
      if (p.kind == BallParameter::Kind::kOffset)
        find_axis(chain, p.joint)->location.offset[p.component] = p.value;
      if (p.kind == BallParameter::Kind::kTilt)
        find_axis(chain, p.joint)->location.tilt[p.component] = p.value;
    }
  }
  double gap(BallContact contact) const {
    contact.stylus_S += stylus_S;
    return ball_gap(chain, contact, ball_B, reach_mm);
  }
  ActualChain chain;
  Vec3 ball_B = Vec3::Zero(), stylus_S = Vec3::Zero();
  double reach_mm = 0;
};

VectorXd gaps(const ActualChain& known, const std::vector<BallParameter>& parameters,
              const std::vector<BallContact>& contacts) {
  // On the whole non-linear chain, not on one of first order: with 0.1 degree of tilt the products that it
  // drops come to tenths of a um.
  const Guess guess(known, parameters);
  VectorXd out(static_cast<Index>(contacts.size()));
  for (std::size_t i = 0; i < contacts.size(); ++i) out[static_cast<Index>(i)] = guess.gap(contacts[i]);
  return out;
}

/// Derivatives of the gaps by the scaled parameters `which`, by central differences.
MatrixXd jacobian(const ActualChain& known, std::vector<BallParameter> parameters,
                  const std::vector<BallContact>& contacts, const std::vector<int>& which) {
  MatrixXd out(static_cast<Index>(contacts.size()), static_cast<Index>(which.size()));
  for (std::size_t k = 0; k < which.size(); ++k) {
    BallParameter& p = parameters[at(which[k])];
    const double value = p.value;
    p.value = value + kDifferenceStep_mm * unit_of(p);
    const VectorXd high = gaps(known, parameters, contacts);
    p.value = value - kDifferenceStep_mm * unit_of(p);
    out.col(static_cast<Index>(k)) = (high - gaps(known, parameters, contacts)) / (2 * kDifferenceStep_mm);
    p.value = value;
  }
  return out;
}

/// The four errors of a rotary axis: offsets and tilts across its direction. A shift along it and a turn
/// about it are no errors of the axis but the zero of its own scale and of what it carries.
void append_axis(const ActualAxis& axis, std::vector<BallParameter>& out) {
  for (const bool tilt : {false, true})
    for (int k = 0; k < 3; ++k) {
      if (std::abs(axis.direction[k]) > 0.5) continue;
      out.push_back({fmt::format("{}.e{}0", axis_name(axis), (tilt ? "abc" : "xyz")[k]),
                     tilt ? BallParameter::Kind::kTilt : BallParameter::Kind::kOffset, axis.joint, k,
                     tilt ? axis.location.tilt[k] : axis.location.offset[k], 0, ""});
    }
}

/// In the order in which they are told apart: nobody knows where the ball is, so it comes first; the stylus
/// is known best and comes last.
std::vector<BallParameter> unknowns(const ActualChain& chain, const Vec3& ball_B, double reach_mm) {
  std::vector<BallParameter> out;
  for (int k = 0; k < 3; ++k)
    out.push_back({fmt::format("ball.{}", "xyz"[k]), BallParameter::Kind::kBall, -1, k, ball_B[k], 0, ""});
  out.push_back({"ball.radius", BallParameter::Kind::kRadius, -1, 0, reach_mm, 0, ""});
  for (const auto* branch : {&chain.tool, &chain.work})
    for (const ActualAxis& axis : *branch)
      if (axis.joint >= 0 && axis.kind == JointKind::kRotary) append_axis(axis, out);
  for (int k = 0; k < 3; ++k)
    out.push_back({fmt::format("stylus.{}", "xyz"[k]), BallParameter::Kind::kStylus, -1, k, 0, 0, ""});
  return out;
}

Vec3 stylus_B(const ActualChain& chain, const BallContact& contact) {
  ActualChain::Frames f;
  chain.evaluate(contact.q, f);
  return f.X_MB.A.inverse() * (f.X_MS.p + f.X_MS.A * contact.stylus_S - f.X_MB.p);
}

/// Sphere through the centres of the stylus in the table: |p|^2 = 2 c.p + (r^2 - |c|^2) is linear in c and
/// the rest. Rms of what is left in `rms`.
std::pair<Vec3, double> sphere_through(const ActualChain& known, const std::vector<BallContact>& contacts) {
  MatrixXd M(static_cast<Index>(contacts.size()), 4);
  VectorXd y(M.rows());
  Vec3 mean = Vec3::Zero();
  std::vector<Vec3> p;
  for (const BallContact& contact : contacts) p.push_back(stylus_B(known, contact));
  for (const Vec3& place : p) mean += place / static_cast<double>(p.size());
  for (Index i = 0; i < M.rows(); ++i) {
    const Vec3 d = p[static_cast<std::size_t>(i)] - mean;
    M.row(i) << 2 * d.transpose(), 1;
    y[i] = d.squaredNorm();
  }
  const LeastSquares equations(M);
  if (equations.rank() < 4)
    throw std::runtime_error("the contacts lie in a plane: no ball goes through them");
  const VectorXd s = equations.solve(y);
  const Vec3 centre = s.head<3>();
  return {mean + centre, std::sqrt(std::max(0.0, s[3] + centre.squaredNorm()))};
}

/// What an untold parameter acts like, in words: the largest shares of those that were told.
std::string acts_like(const MatrixXd& J, const VectorXd& column, const std::vector<BallParameter>& parameters,
                      const std::vector<int>& chosen) {
  const VectorXd share = LeastSquares(J).solve(column);
  std::string text;
  for (Index k = 0; k < share.size(); ++k) {
    if (std::abs(share[k]) < 0.05) continue;
    text +=
        fmt::format("{}{:.2g} {}", text.empty() ? (share[k] < 0 ? "-" : "") : (share[k] < 0 ? " - " : " + "),
                    std::abs(share[k]), parameters[at(chosen[static_cast<std::size_t>(k)])].name);
  }
  return "acts like " + text;
}

/// The parameters that the contacts can tell apart, taken in turn as far as they are more than a sum of those
/// before.
std::vector<int> tellable(const ActualChain& known, std::vector<BallParameter>& parameters,
                          const std::vector<BallContact>& contacts) {
  std::vector<int> all, chosen;
  for (std::size_t i = 0; i < parameters.size(); ++i) all.push_back(static_cast<int>(i));
  const MatrixXd J = jacobian(known, parameters, contacts, all);
  const double largest = J.colwise().norm().maxCoeff();
  MatrixXd told(J.rows(), 0);
  for (const int i : all) {
    BallParameter& p = parameters[at(i)];
    const VectorXd column = J.col(i);
    VectorXd rest = column;
    if (told.cols() > 0) rest -= told * LeastSquares(told).solve(column);
    // What others explain to 98 % would be told with fifty times the noise of a touch: a number that looks
    // like a result and is none.
    if (column.norm() < kTellableShare * largest) {
      p.unknown = "the contacts do not depend on it to first order";
    } else if (rest.norm() < kTellableShare * column.norm()) {
      p.unknown = acts_like(told, column, parameters, chosen);
    } else {
      chosen.push_back(i);
      told.conservativeResize(Eigen::NoChange, told.cols() + 1);
      told.col(told.cols() - 1) = column;
    }
  }
  return chosen;
}

double rms(const VectorXd& v) { return std::sqrt(v.squaredNorm() / static_cast<double>(v.size())); }

/// Gauss and Newton's steps on `which`: the problem is nearly linear, and a step is taken until it is
/// nothing.
void solve(const ActualChain& known, const std::vector<BallContact>& contacts, const std::vector<int>& which,
           std::vector<BallParameter>& parameters) {
  for (int step = 0; step < kStepsMax; ++step) {
    const MatrixXd J = jacobian(known, parameters, contacts, which);
    const VectorXd dx = -LeastSquares(J).solve(gaps(known, parameters, contacts));
    for (std::size_t k = 0; k < which.size(); ++k) {
      BallParameter& p = parameters[at(which[k])];
      p.value += dx[static_cast<Index>(k)] * unit_of(p);
    }
    if (!dx.allFinite()) break;
    if (dx.norm() < kConverged) return;
  }
  throw std::runtime_error("the fit found no ball: are these the contacts of one ball, in mm and degrees?");
}

void judge(const ActualChain& known, const std::vector<BallContact>& contacts, BallFit& fit) {
  const VectorXd left = gaps(known, fit.parameters, contacts);
  const MatrixXd J = jacobian(known, fit.parameters, contacts, fit.fitted);
  fit.residual_mm.assign(left.data(), left.data() + left.size());
  // Each unknown takes one contact's worth of freedom out of the residuals.
  fit.noise_mm = std::sqrt(left.squaredNorm() / static_cast<double>(J.rows() - J.cols()));
  // The bound of Cramér and Rao for independent noise of the same size on every touch.
  const LeastSquares equations(J);
  const MatrixXd inverse = equations.covariance();
  const VectorXd scale = inverse.diagonal().cwiseSqrt();
  fit.correlation = scale.cwiseInverse().asDiagonal() * inverse * scale.cwiseInverse().asDiagonal();
  for (std::size_t k = 0; k < fit.fitted.size(); ++k) {
    BallParameter& p = fit.parameters[at(fit.fitted[k])];
    p.deviation = fit.noise_mm * scale[static_cast<Index>(k)] * unit_of(p);
  }
  fit.condition = equations.condition();
}

}  // namespace

double ball_gap(const ActualChain& chain, const BallContact& contact, const Vec3& ball_B, double reach_mm) {
  ActualChain::Frames f;
  chain.evaluate(contact.q, f);
  const Vec3 ball = f.X_MB.p + f.X_MB.A * ball_B, stylus = f.X_MS.p + f.X_MS.A * contact.stylus_S;
  return (stylus - ball).norm() - reach_mm;
}

BallFit fit_ball(const ActualChain& known, const std::vector<BallContact>& contacts) {
  if (contacts.size() < 5) throw std::runtime_error("too few contacts: one position has five");
  const auto [centre, reach] = sphere_through(known, contacts);
  BallFit fit;
  fit.parameters = unknowns(known, centre, reach);
  // As good as the machine is known: only the ball is looked for.
  std::vector<BallParameter> plain = fit.parameters;
  solve(known, contacts, {0, 1, 2, 3}, plain);
  fit.before_mm = rms(gaps(known, plain, contacts));
  fit.parameters = plain;
  fit.fitted = tellable(known, fit.parameters, contacts);
  if (contacts.size() <= fit.fitted.size())
    throw std::runtime_error(
        fmt::format("too few contacts: {} of them for {} unknowns", contacts.size(), fit.fitted.size()));
  solve(known, contacts, fit.fitted, fit.parameters);
  judge(known, contacts, fit);
  return fit;
}

BallInformation::BallInformation(const ActualChain& known, const Vec3& ball_B, double reach_mm,
                                 double noise_mm)
    : known_(known), noise_mm_(noise_mm), parameters_(unknowns(known, ball_B, reach_mm)) {
  // The stylus is taken as known: no position tells its errors from those of the axes on most machines.
  while (!parameters_.empty() && parameters_.back().kind == BallParameter::Kind::kStylus)
    parameters_.pop_back();
  const auto n = static_cast<Index>(parameters_.size());
  information_ = MatrixXd::Identity(n, n) / (kPrior * kPrior);
}

MatrixXd BallInformation::information_of(const std::vector<BallContact>& contacts) const {
  std::vector<int> all;
  for (std::size_t i = 0; i < parameters_.size(); ++i) all.push_back(static_cast<int>(i));
  const MatrixXd J = jacobian(known_, parameters_, contacts, all);
  return J.transpose() * J / (noise_mm_ * noise_mm_);
}

void BallInformation::add(const std::vector<BallContact>& contacts) {
  information_ += information_of(contacts);
}

VectorXd BallInformation::variances(const std::vector<BallContact>& more) const {
  const MatrixXd sum = more.empty() ? information_ : MatrixXd(information_ + information_of(more));
  return sum.llt().solve(MatrixXd::Identity(sum.rows(), sum.cols())).diagonal();
}

std::vector<double> BallInformation::deviations(const std::vector<BallContact>& more) const {
  const VectorXd v = variances(more);
  std::vector<double> out;
  for (Index i = 0; i < v.size(); ++i)
    out.push_back(std::sqrt(v[i]) * unit_of(parameters_[static_cast<std::size_t>(i)]));
  return out;
}

double BallInformation::axes_mm(const std::vector<BallContact>& more) const {
  const VectorXd v = variances(more);
  double sum = 0;
  int count = 0;
  for (Index i = 0; i < v.size(); ++i)
    if (is_error(parameters_[static_cast<std::size_t>(i)])) sum += v[i], ++count;
  return std::sqrt(sum / std::max(1, count));
}

}  // namespace trn
