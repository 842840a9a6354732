#include "app/lab/tune/tune_fit.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace trn {

namespace {

constexpr double kWindowS = 0.02;   // of the smooth window
constexpr double kSlowest = 0.004;  // of the joint's velocity: below, friction has no sure sign
constexpr std::size_t kRowsMin = 500;
constexpr double kTurnMin = 0.35;  // rad: a smaller turn does not tell weight from imbalance

using Vector = Eigen::VectorXd;

/// Smooths by a Hann window of an odd number of periods; at the ends it is shorter.
class Smoother {
 public:
  explicit Smoother(double period_s)
      : half_(std::max(2, static_cast<int>(std::lround(kWindowS / period_s / 2)))) {
    for (int i = -half_; i <= half_; ++i)
      weights_.push_back(1 + std::cos(std::numbers::pi * i / (half_ + 1.0)));
    double sum = 0;
    for (const double w : weights_) sum += w;
    for (double& w : weights_) w /= sum;
  }
  int half() const { return half_; }
  template <typename Value>
  double at(int k, Value value) const {
    double sum = 0;
    for (int i = -half_; i <= half_; ++i) sum += weights_[static_cast<std::size_t>(i + half_)] * value(k + i);
    return sum;
  }

 private:
  int half_;
  std::vector<double> weights_;
};

/// One row of the least squares.
struct FitRow {
  Vector regressors;
  double force = 0;
  int stroke = 0;
};

class RowMaker {
 public:
  RowMaker(const TuneData& data, const Joint& joint, double cogging_pitch)
      : data_(data),
        joint_(joint),
        cogging_pitch_(cogging_pitch),
        smoother_(data.period_s),
        imbalance_(turns_enough()) {}

  bool imbalance() const { return imbalance_; }
  std::vector<FitRow> make() const {
    std::vector<FitRow> rows;
    const int reach = smoother_.half() + 1, end = static_cast<int>(data_.rows()) - reach;
    for (int k = reach; k < end; ++k)
      if (moves_one_way(k, reach)) rows.push_back(row(k));
    return rows;
  }

 private:
  double q(int k) const { return data_.measured[static_cast<std::size_t>(k)]; }
  double speed(int k) const { return (q(k + 1) - q(k - 1)) / (2 * data_.period_s); }

  bool turns_enough() const {
    const auto [low, high] = std::minmax_element(data_.measured.begin(), data_.measured.end());
    return joint_.kind == JointKind::kRotary && *high - *low > kTurnMin;
  }

  // All over the window the joint moves in one direction, and the drive told its force.
  bool moves_one_way(int k, int reach) const {
    const double sign = speed(k) > 0 ? 1 : -1;
    // Ends and middle of the window: speeds change evenly over so short a time.
    for (const int i : {-reach + 1, -reach / 2, 0, reach / 2, reach - 1})
      if (sign * smooth_speed(k + i) < kSlowest * joint_.limit.velocity) return false;
    return std::isfinite(data_.force[static_cast<std::size_t>(k)]) &&
           data_.stroke[static_cast<std::size_t>(k)] >= 0 &&
           data_.stroke[static_cast<std::size_t>(k)] < data_.first_stirred;
  }
  double smooth_speed(int k) const {
    const int n = static_cast<int>(data_.rows());
    const int from = std::clamp(k - 4, 0, n - 1), to = std::clamp(k + 4, 0, n - 1);
    return (q(to) - q(from)) / (std::max(1, to - from) * data_.period_s);
  }

  FitRow row(int k) const {
    const double dt = data_.period_s;
    const auto place = [&](int at) { return q(at); };
    const double before = smoother_.at(k - 1, place), here = smoother_.at(k, place),
                 behind = smoother_.at(k + 1, place);
    const double v = (behind - before) / (2 * dt), a = (behind - 2 * here + before) / (dt * dt);
    FitRow out;
    const Eigen::Index base = imbalance_ ? 6 : 4;
    out.regressors.resize(base + (cogging_pitch_ > 0 ? 2 * kCoggingWavesMax : 0));
    out.regressors.head<4>() << a, v, (v > 0 ? 1.0 : -1.0), 1.0;
    if (imbalance_) {
      out.regressors[4] = smoother_.at(k, [&](int at) { return std::cos(q(at)); });
      out.regressors[5] = smoother_.at(k, [&](int at) { return std::sin(q(at)); });
    }
    for (int wave = 1; cogging_pitch_ > 0 && wave <= kCoggingWavesMax; ++wave) {
      const double turn = 2 * std::numbers::pi * wave / cogging_pitch_;
      out.regressors[base + 2 * wave - 2] = smoother_.at(k, [&](int at) { return std::cos(turn * q(at)); });
      out.regressors[base + 2 * wave - 1] = smoother_.at(k, [&](int at) { return std::sin(turn * q(at)); });
    }
    out.force = smoother_.at(k, [&](int at) { return data_.force[static_cast<std::size_t>(at)]; });
    out.stroke = data_.stroke[static_cast<std::size_t>(k)];
    return out;
  }

  const TuneData& data_;
  const Joint& joint_;
  double cogging_pitch_;
  Smoother smoother_;
  bool imbalance_;
};

/// Ordinary least squares with deviations that are robust against what neighbours have in common: the
/// sandwich of the normal matrix and the strokes' own scores (White 1980, Liang and Zeger 1986).
struct Solution {
  Vector x, deviation;
  double residual = 0, explained = 0;
};

Solution solve(const std::vector<FitRow>& rows) {
  const Eigen::Index n = rows.front().regressors.size();
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(n, n);
  Vector right = Vector::Zero(n);
  double sum = 0, squares = 0;
  // Scaled to one size, so that mm/s^2 and ones weigh alike.
  Vector scale = Vector::Zero(n);
  for (const FitRow& row : rows) scale = scale.cwiseMax(row.regressors.cwiseAbs());
  for (const FitRow& row : rows) {
    const Vector r = row.regressors.cwiseQuotient(scale);
    normal += r * r.transpose();
    right += r * row.force;
    sum += row.force;
    squares += row.force * row.force;
  }
  const Eigen::LDLT<Eigen::MatrixXd> ldlt(normal);
  const Vector x = ldlt.solve(right);
  std::map<int, Vector> scores;
  double residuals = 0;
  for (const FitRow& row : rows) {
    const Vector r = row.regressors.cwiseQuotient(scale);
    const double e = row.force - r.dot(x);
    residuals += e * e;
    auto [at, added] = scores.try_emplace(row.stroke, Vector::Zero(n));
    at->second += e * r;
  }
  Eigen::MatrixXd middle = Eigen::MatrixXd::Zero(n, n);
  for (const auto& [stroke, score] : scores) middle += score * score.transpose();
  const auto groups = static_cast<double>(scores.size());
  const Eigen::MatrixXd inverse = ldlt.solve(Eigen::MatrixXd::Identity(n, n));
  const Eigen::MatrixXd covariance = inverse * middle * inverse * (groups / std::max(1.0, groups - 1));
  const auto count = static_cast<double>(rows.size());
  Solution out;
  out.x = x.cwiseQuotient(scale);
  out.deviation = covariance.diagonal().cwiseMax(0).cwiseSqrt().cwiseQuotient(scale);
  out.residual = std::sqrt(residuals / count);
  const double variance = squares / count - sum * sum / (count * count);
  out.explained = variance > 0 ? 1 - residuals / count / variance : 0;
  return out;
}

}  // namespace

JointModel TuneFit::model(double coulomb_speed) const {
  JointModel out;
  out.inertia = inertia.value;
  out.viscous = std::max(0.0, viscous.value);
  out.coulomb = std::max(0.0, coulomb.value);
  out.coulomb_speed = coulomb_speed;
  out.gravity = gravity.value;
  out.imbalance_cos = imbalance_cos.value;
  out.imbalance_sin = imbalance_sin.value;
  return out;
}

NoTorque::NoTorque(const Joint& joint)
    : std::runtime_error(
          fmt::format("the drive of joint {} does not tell its torque. On CAN its node needs "
                      "'torque = true', and {}, unless its data sheet says it",
                      joint.name, joint.kind == JointKind::kRotary ? "rated_torque_Nm" : "rated_force_N")) {}

double TuneFit::cogging_at(double q) const {
  double sum = 0;
  for (std::size_t i = 0; i < cogging_cos.size(); ++i) {
    const double turn = 2 * std::numbers::pi * static_cast<double>(i + 1) * q / cogging_pitch;
    sum += cogging_cos[i].value * std::cos(turn) + cogging_sin[i].value * std::sin(turn);
  }
  return sum;
}

bool TuneFit::cogs() const {
  for (std::size_t i = 0; i < cogging_cos.size(); ++i)
    if (std::hypot(cogging_cos[i].value, cogging_sin[i].value) >
        4 * std::hypot(cogging_cos[i].deviation, cogging_sin[i].deviation))
      return true;
  return false;
}

TuneFit fit_joint(const TuneData& data, const Joint& joint, double cogging_pitch) {
  const RowMaker maker(data, joint, cogging_pitch);
  const std::vector<FitRow> rows = maker.make();
  const bool told =
      std::any_of(data.force.begin(), data.force.end(), [](double f) { return std::isfinite(f); });
  if (!told) throw NoTorque(joint);
  if (rows.size() < kRowsMin)
    throw std::runtime_error(
        fmt::format("{} periods of even motion are too few to tell anything of joint {}; "
                    "give it a longer --length",
                    rows.size(), joint.name));
  const Solution found = solve(rows);
  TuneFit fit;
  const auto take = [&](Eigen::Index i) { return TuneValue{found.x[i], found.deviation[i]}; };
  fit.inertia = take(0);
  fit.viscous = take(1);
  fit.coulomb = take(2);
  fit.gravity = take(3);
  if (maker.imbalance()) {
    fit.imbalance_cos = take(4);
    fit.imbalance_sin = take(5);
  }
  fit.cogging_pitch = cogging_pitch;
  for (int wave = 0; cogging_pitch > 0 && wave < kCoggingWavesMax; ++wave) {
    const Eigen::Index at = (maker.imbalance() ? 6 : 4) + 2 * wave;
    fit.cogging_cos.push_back(take(at));
    fit.cogging_sin.push_back(take(at + 1));
  }
  fit.residual = found.residual;
  fit.explained = found.explained;
  fit.rows = rows.size();
  return fit;
}

std::optional<TuneValue> lost_motion(const TuneData& data, const TuneFit& fit, std::size_t first_slow) {
  // Weight beyond friction holds the joint on one flank for good.
  if (fit.coulomb.value <= 0 || std::abs(fit.gravity.value) > fit.coulomb.value) return std::nullopt;
  std::vector<double> ways;
  double steps = 0;
  const auto begins = [&](std::size_t k) {
    return data.stroke[k] >= static_cast<int>(first_slow) + 1 && data.stroke[k] != data.stroke[k - 1];
  };
  for (std::size_t k = 1; k < data.rows(); ++k) {
    if (!begins(k)) continue;
    const int stroke = data.stroke[k];
    const double from = data.measured[k];
    for (std::size_t i = k; i < data.rows() && data.stroke[i] == stroke; ++i) {
      const double way = data.measured[i] - from, direction = data.setpoint[i] > data.setpoint[k] ? 1 : -1;
      if (data.setpoint[i] == data.setpoint[k]) continue;
      if (direction * (data.force[i] - fit.gravity.value) < 0.6 * fit.coulomb.value) continue;
      ways.push_back(std::abs(way));
      steps += std::abs(data.measured[i] - data.measured[i - 1]);
      break;
    }
  }
  if (ways.size() < 3) return std::nullopt;
  double mean = 0, squares = 0;
  for (const double way : ways) mean += way / static_cast<double>(ways.size());
  for (const double way : ways) squares += (way - mean) * (way - mean);
  const auto n = static_cast<double>(ways.size());
  // No period is looked into.
  const double seen = steps / n / std::sqrt(12.0);
  return TuneValue{mean, std::max(seen, std::sqrt(squares / (n - 1) / n))};
}

}  // namespace trn
