#include "compensation/fit/ballbar_fit.h"

#include <ceres/ceres.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <stdexcept>

#include "compensation/fit/least_squares.h"
#include "compensation/fit/rotary_fit.h"
#include "core/axes.h"

namespace trn {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

double unit_of(const BallbarParameter& p) {
  return p.kind == BallbarParameter::Kind::kTilt ? 1 / kTiltArm_mm : 1;
}

/// Everything a fit is about: traces and unknowns. Unknowns are scaled to mm.
class Model {
 public:
  Model(const ActualChain& nominal, const std::vector<BallbarTrace>& traces)
      : nominal_(nominal), traces_(traces) {
    for (const BallbarTrace& trace : traces) count_ += static_cast<Eigen::Index>(trace.readings.size());
  }
  Eigen::Index count() const { return count_; }

  /// Readings predicted less measured, mm.
  VectorXd residuals(const std::vector<BallbarParameter>& parameters) const {
    // The readings of the whole non-linear chain, not of a model to first order: with 0.1 degree of tilt the
    // products that it drops come to tenths of a um.
    ActualChain chain = nominal_;
    for (const BallbarParameter& p : parameters) place(p, chain);
    VectorXd out(count_);
    Eigen::Index row = 0;
    for (const BallbarTrace& trace : traces_) {
      const BallbarSetup setup = setup_of(parameters, trace.test);
      // The machine was driven by its nominal kinematics without any correction, so the linear axes stand
      // where the nominal chain puts the cup.
      JointVec q = ballbar_joints(nominal_, trace.test, 0);
      for (const BallbarReading& reading : trace.readings) {
        q[trace.test.joint] = reading.angle_rad;
        out[row++] = ballbar_reading(chain, trace.test, setup, q) - reading.reading_mm;
      }
    }
    return out;
  }

  /// Derivatives of the residuals by the scaled unknowns `which`, by central differences.
  MatrixXd jacobian(std::vector<BallbarParameter> parameters, const std::vector<int>& which) const {
    MatrixXd out(count_, static_cast<Eigen::Index>(which.size()));
    for (std::size_t k = 0; k < which.size(); ++k) {
      BallbarParameter& p = parameters[static_cast<std::size_t>(which[k])];
      const double value = p.value;
      // A step of 1 um is far above rounding and small enough that the squares it leaves, which central
      // differences cancel at that, do not count.
      p.value = value + kDifferenceStep_mm * unit_of(p);
      const VectorXd high = residuals(parameters);
      p.value = value - kDifferenceStep_mm * unit_of(p);
      out.col(static_cast<Eigen::Index>(k)) = (high - residuals(parameters)) / (2 * kDifferenceStep_mm);
      p.value = value;
    }
    return out;
  }

 private:
  static void place(const BallbarParameter& p, ActualChain& chain) {
    if (p.kind == BallbarParameter::Kind::kOffset)
      find_axis(chain, p.joint)->location.offset[p.component] = p.value;
    if (p.kind == BallbarParameter::Kind::kTilt)
      find_axis(chain, p.joint)->location.tilt[p.component] = p.value;
  }
  static BallbarSetup setup_of(const std::vector<BallbarParameter>& parameters, const BallbarTest& test) {
    BallbarSetup setup;
    for (const BallbarParameter& p : parameters) {
      if (p.kind == BallbarParameter::Kind::kBall && p.joint == test.joint)
        setup.ball_offset_B[p.component] = p.value;
      if (p.kind == BallbarParameter::Kind::kCup) setup.cup_offset_M[p.component] = p.value;
    }
    return setup;
  }

  const ActualChain& nominal_;
  const std::vector<BallbarTrace>& traces_;
  Eigen::Index count_ = 0;
};

/// The four errors of a rotary axis: offsets and tilts across its direction.
void append_axis(const ActualAxis& axis, const std::string& name, std::vector<BallbarParameter>& out) {
  for (const bool tilt : {false, true})
    for (int k = 0; k < 3; ++k) {
      // An offset along the axis and a turn about it are no errors of the axis: they are the zero of the
      // axis' own scale and of the table's height.
      if (std::abs(axis.direction[k]) > 0.5) continue;
      const char letter = (tilt ? "abc" : "xyz")[k];
      const double value = tilt ? axis.location.tilt[k] : axis.location.offset[k];
      out.push_back({fmt::format("{}.e{}0", name, letter),
                     tilt ? BallbarParameter::Kind::kTilt : BallbarParameter::Kind::kOffset, axis.joint, k,
                     value, 0, ""});
    }
}

std::vector<BallbarParameter> unknowns(const ActualChain& chain, bool setup) {
  std::vector<BallbarParameter> out;
  std::vector<const ActualAxis*> axes;
  for (const ActualAxis& axis : chain.work)
    if (axis.joint >= 0 && axis.kind == JointKind::kRotary) axes.push_back(&axis);
  for (const ActualAxis* axis : axes) append_axis(*axis, axis_name(*axis), out);
  if (!setup) return out;
  for (const ActualAxis* axis : axes)
    for (int k = 0; k < 3; ++k)
      out.push_back({fmt::format("ball of {}.{}", axis_name(*axis), "xyz"[k]), BallbarParameter::Kind::kBall,
                     axis->joint, k, 0, 0, ""});
  // One cup for all tests, but a ball for each axis: the ball is set up anew when the bar is turned to the
  // other axis.
  for (int k = 0; k < 3; ++k)
    out.push_back({fmt::format("cup.{}", "xyz"[k]), BallbarParameter::Kind::kCup, 0, k, 0, 0, ""});
  return out;
}

/// The unknowns that the readings can tell apart: the machine's errors must be among them, those of the
/// set-up are taken in turn as far as they are more than a sum of those before.
std::vector<int> tellable(const Model& model, std::vector<BallbarParameter>& parameters) {
  std::vector<int> all, chosen;
  for (std::size_t i = 0; i < parameters.size(); ++i) all.push_back(static_cast<int>(i));
  const MatrixXd J = model.jacobian(parameters, all);
  MatrixXd basis(J.rows(), 0);
  const double largest = J.colwise().norm().maxCoeff();
  for (const int i : all) {
    BallbarParameter& p = parameters[static_cast<std::size_t>(i)];
    VectorXd rest = J.col(i);
    const double norm = rest.norm();
    // Gram and Schmidt, twice: after the first pass rounding leaves parts along the basis that may be as
    // large as what is to be judged.
    const VectorXd share = basis.transpose() * rest;
    rest -= basis * share;
    rest -= basis * (basis.transpose() * rest);
    // An unknown whose column others explain to 98 % would be told with fifty times the noise of a reading: a
    // number that looks like a result and is none.
    if (norm < kTellableShare * largest) {
      p.unknown = "the readings do not depend on it to first order";
    } else if (rest.norm() < kTellableShare * norm) {
      p.unknown = "acts like a sum of the errors above it";
    } else {
      chosen.push_back(i);
      basis.conservativeResize(Eigen::NoChange, basis.cols() + 1);
      basis.col(basis.cols() - 1) = rest.normalized();
    }
    // A fit that leaves a set-up error out is still a fit of the machine. One that leaves an error of the
    // machine out would put that error into the others without a word.
    if (!p.unknown.empty() &&
        (p.kind == BallbarParameter::Kind::kOffset || p.kind == BallbarParameter::Kind::kTilt))
      throw std::runtime_error(fmt::format("these traces cannot tell {}: {}", p.name, p.unknown));
  }
  return chosen;
}

/// All residuals as one cost of Ceres; one parameter block.
class Cost final : public ceres::CostFunction {
 public:
  Cost(const Model& model, const std::vector<BallbarParameter>& parameters, const std::vector<int>& which)
      : model_(model), parameters_(parameters), which_(which) {
    set_num_residuals(static_cast<int>(model.count()));
    mutable_parameter_block_sizes()->push_back(static_cast<int>(which.size()));
  }
  bool Evaluate(double const* const* blocks, double* residuals, double** jacobians) const override {
    std::vector<BallbarParameter> now = parameters_;
    for (std::size_t k = 0; k < which_.size(); ++k) {
      BallbarParameter& p = now[static_cast<std::size_t>(which_[k])];
      p.value = blocks[0][k] * unit_of(p);
    }
    Eigen::Map<VectorXd>(residuals, model_.count()) = model_.residuals(now);
    if (!jacobians || !jacobians[0]) return true;
    using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
    Eigen::Map<RowMajor>(jacobians[0], model_.count(), static_cast<Eigen::Index>(which_.size())) =
        model_.jacobian(now, which_);
    return true;
  }

 private:
  const Model& model_;
  const std::vector<BallbarParameter>& parameters_;
  const std::vector<int>& which_;
};

void solve(const Model& model, BallbarFit& fit) {
  std::vector<double> x;
  for (const int i : fit.fitted) {
    const BallbarParameter& p = fit.parameters[static_cast<std::size_t>(i)];
    x.push_back(p.value / unit_of(p));
  }
  ceres::Problem problem;
  problem.AddResidualBlock(new Cost(model, fit.parameters, fit.fitted), nullptr, x.data());
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::DENSE_QR;
  // The problem is nearly linear and has some ten unknowns. The trust region is opened wide, so that the
  // first steps are Gauss and Newton's own, and only the parameters' own change ends them.
  options.function_tolerance = options.gradient_tolerance = 0;
  options.parameter_tolerance = 1e-13;
  options.initial_trust_region_radius = 1e12;
  options.max_num_iterations = 12;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  if (!summary.IsSolutionUsable()) throw std::runtime_error("the fit found no solution: " + summary.message);
  for (std::size_t k = 0; k < x.size(); ++k) {
    BallbarParameter& p = fit.parameters[static_cast<std::size_t>(fit.fitted[k])];
    p.value = x[k] * unit_of(p);
  }
}

double peak_to_peak(const VectorXd& values) { return values.maxCoeff() - values.minCoeff(); }

void judge(const Model& model, const std::vector<BallbarTrace>& traces, const BallbarFitOptions& options,
           BallbarFit& fit) {
  const VectorXd left = model.residuals(fit.parameters);
  const MatrixXd J = model.jacobian(fit.parameters, fit.fitted);
  fit.rms_mm = std::sqrt(left.squaredNorm() / static_cast<double>(left.size()));
  // Each unknown takes one reading's worth of freedom out of the residuals.
  const auto free = static_cast<double>(std::max<Eigen::Index>(1, J.rows() - J.cols()));
  const double sigma = options.noise_mm.value_or(std::sqrt(left.squaredNorm() / free));
  // The bound of Cramér and Rao for independent noise of the same size on every reading.
  const LeastSquares equations(J);
  const MatrixXd covariance = sigma * sigma * equations.covariance();
  const VectorXd scale = covariance.diagonal().cwiseSqrt();
  fit.correlation = equations.covariance();
  const VectorXd unit = fit.correlation.diagonal().cwiseSqrt().cwiseInverse();
  fit.correlation = unit.asDiagonal() * fit.correlation * unit.asDiagonal();
  for (std::size_t k = 0; k < fit.fitted.size(); ++k) {
    BallbarParameter& p = fit.parameters[static_cast<std::size_t>(fit.fitted[k])];
    p.deviation = scale[static_cast<Eigen::Index>(k)] * unit_of(p);
  }
  fit.condition = equations.condition();
  Eigen::Index row = 0;
  for (const BallbarTrace& trace : traces) {
    const auto n = static_cast<Eigen::Index>(trace.readings.size());
    fit.before_mm.push_back(trace.peak_to_peak_mm());
    fit.after_mm.push_back(peak_to_peak(left.segment(row, n)));
    row += n;
  }
}

/// Centre of the circle that a trace stands for, in the turning plane: reading = mean - centre . direction.
Eigen::Vector2d centre_of(const BallbarTrace& trace) {
  const auto n = static_cast<Eigen::Index>(trace.readings.size());
  MatrixXd M(n, 3);
  VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const BallbarReading& r = trace.readings[static_cast<std::size_t>(i)];
    // Beside the centre the reading changes with the cosine and the sine of the angle, to first order. So
    // mean and centre are three unknowns that least squares find at once.
    M.row(i) << 1, std::cos(r.angle_rad), std::sin(r.angle_rad);
    y[i] = r.reading_mm;
  }
  return LeastSquares(M).solve(y).tail<2>();
}

// One number that is none would make none of every residual.
void check_readings(const std::vector<BallbarTrace>& traces) {
  for (const BallbarTrace& trace : traces)
    for (std::size_t i = 0; i < trace.readings.size(); ++i) {
      const BallbarReading& reading = trace.readings[i];
      const bool angle = std::isfinite(reading.angle_rad);
      if (!angle || !std::isfinite(reading.reading_mm))
        throw std::runtime_error(fmt::format("{} of test '{}' is not a finite number: number {} of {}",
                                             angle ? "a reading" : "an angle", trace.test.name, i + 1,
                                             trace.readings.size()));
    }
}

const BallbarTrace& trace_named(const std::vector<BallbarTrace>& traces, const char* name) {
  for (const BallbarTrace& trace : traces)
    if (trace.test.name == name) return trace;
  throw std::runtime_error(fmt::format("the planar method needs the trace of test {}", name));
}

}  // namespace

BallbarFit fit_ballbar(const ActualChain& nominal, const std::vector<BallbarTrace>& traces,
                       const BallbarFitOptions& options) {
  check_readings(traces);
  const Model model(nominal, traces);
  if (model.count() < 40) throw std::runtime_error("too few readings: a test has some hundred");
  BallbarFit fit;
  fit.parameters = unknowns(nominal, options.fit_setup);
  fit.fitted = tellable(model, fit.parameters);
  solve(model, fit);
  judge(model, traces, options, fit);
  return fit;
}

BallbarFit fit_planar(const ActualChain& nominal, const std::vector<BallbarTrace>& traces) {
  check_readings(traces);
  const BallbarTrace &left = trace_named(traces, "a_left"), &right = trace_named(traces, "a_right");
  const BallbarTrace &low = trace_named(traces, "c_low"), &high = trace_named(traces, "c_high");
  const Eigen::Vector2d a0 = centre_of(left), a1 = centre_of(right), c0 = centre_of(low),
                        c1 = centre_of(high);
  const double da = right.test.cup_M.x() - left.test.cup_M.x(), dc = high.test.cup_M.z() - low.test.cup_M.z();
  // A: centre (y, z) at x: e_y + tilt_z x, e_z - tilt_y x. C: centre (x, y) at z: e_x + tilt_y z, e_y -
  // tilt_x z, and A's errors below it.
  const Eigen::Vector2d a = (a0 + a1) / 2, ta = (a1 - a0) / da, c = (c0 + c1) / 2, tc = (c1 - c0) / dc;
  BallbarFit fit;
  fit.parameters = unknowns(nominal, false);
  // In the order of `unknowns`: offsets, then tilts, of A and then of C. A stands below C, so the offset and
  // tilt of A that C's circle also shows are taken off it.
  const double values[] = {a[0], a[1], -ta[1], ta[0], c[0], c[1] - a[0], -tc[1], tc[0] + ta[1]};
  for (std::size_t i = 0; i < fit.parameters.size() && i < 8; ++i) {
    fit.parameters[i].value = values[i];
    fit.fitted.push_back(static_cast<int>(i));
  }
  return fit;
}

}  // namespace trn
