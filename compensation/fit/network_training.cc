#include "compensation/fit/network_training.h"

#include <ceres/ceres.h>

#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>

namespace trn {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMajor = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

constexpr double kWeightPenalty = 1e-3;  // keeps nodes that the data does not need from growing without end

/// All residuals of a network at once, with the derivatives by back-propagation. Weights as in
/// FrictionNetwork.
class NetworkCost final : public ceres::CostFunction {
 public:
  NetworkCost(const FrictionNetwork::Shape& shape, MatrixXd inputs, VectorXd targets)
      : shape_(shape), inputs_(std::move(inputs)), targets_(std::move(targets)) {
    set_num_residuals(static_cast<int>(targets_.size()) + shape.weight_count());
    mutable_parameter_block_sizes()->push_back(shape.weight_count());
  }

  bool Evaluate(double const* const* parameters, double* residuals, double** jacobians) const override {
    const double* weights = parameters[0];
    std::vector<MatrixXd> active(1, inputs_);  // per layer: nodes by samples
    int offset = 0;
    for (int layer = 0; layer < shape_.layers; ++layer) {
      active.push_back(sigmoid(affine(weights, offset, shape_.nodes, active.back())));
      offset += shape_.nodes * (static_cast<int>(active[active.size() - 2].rows()) + 1);
    }
    const Eigen::Index samples = targets_.size(), count = shape_.weight_count();
    Eigen::Map<VectorXd> r(residuals, samples + count);
    r.head(samples) = affine(weights, offset, 1, active.back()).row(0).transpose() - targets_;
    // The penalty is written as further residuals, one a weight, so that a method for sums of squares sees
    // it.
    r.tail(count) = kWeightPenalty * Eigen::Map<const VectorXd>(weights, count);
    if (!jacobians || !jacobians[0]) return true;
    Eigen::Map<RowMajor> J(jacobians[0], samples + count, count);
    J.bottomRows(count) = kWeightPenalty * MatrixXd::Identity(count, count);
    auto top = J.topRows(samples);
    back_propagate(weights, offset, active, top);
    return true;
  }

 private:
  static MatrixXd sigmoid(const MatrixXd& x) { return (1 + (-x.array()).exp()).inverse().matrix(); }
  static MatrixXd affine(const double* weights, int offset, int rows, const MatrixXd& x) {
    const Eigen::Map<const MatrixXd> W(weights + offset, rows, x.rows());
    const Eigen::Map<const VectorXd> b(weights + offset + rows * x.rows(), rows);
    return (W * x).colwise() + b;
  }

  template <typename Rows>
  void back_propagate(const double* weights, int offset, const std::vector<MatrixXd>& active, Rows& J) const {
    // The output is linear, so its own slope is 1. From there the loop goes back layer by layer.
    MatrixXd delta = MatrixXd::Ones(1, targets_.size());  // d output / d sum of the layer's nodes
    for (int layer = shape_.layers;; --layer) {
      const MatrixXd& x = active[static_cast<std::size_t>(layer)];
      const Eigen::Index rows = delta.rows(), width = x.rows();
      for (Eigen::Index k = 0; k < width; ++k)
        for (Eigen::Index n = 0; n < rows; ++n)
          J.col(offset + k * rows + n) = delta.row(n).cwiseProduct(x.row(k)).transpose();
      for (Eigen::Index n = 0; n < rows; ++n) J.col(offset + width * rows + n) = delta.row(n).transpose();
      if (layer == 0) return;
      const Eigen::Map<const MatrixXd> W(weights + offset, rows, width);
      // The slope of a sigmoid by its own value, x (1 - x).
      const MatrixXd slope = (x.array() * (1 - x.array())).matrix();
      delta = (W.transpose() * delta).cwiseProduct(slope);
      const Eigen::Index before = active[static_cast<std::size_t>(layer - 1)].rows();
      offset -= static_cast<int>(width * (before + 1));
    }
  }

  FrictionNetwork::Shape shape_;
  MatrixXd inputs_;
  VectorXd targets_;
};

MatrixXd scaled_inputs(const FrictionNetwork::Shape& shape, const MatrixXd& taps) {
  MatrixXd inputs = taps / shape.travel_scale_mm;
  inputs.row(0) = taps.row(0) / shape.position_scale_mm;
  return inputs;
}

// First-layer nodes spread their slopes over the inputs' range; some are steep, for friction's turn at rest.
std::vector<double> random_weights(const FrictionNetwork::Shape& shape, std::mt19937_64& random) {
  std::normal_distribution<double> normal;
  std::vector<double> weights(static_cast<std::size_t>(shape.weight_count()));
  for (double& weight : weights) weight = 0.5 * normal(random);
  const int nodes = shape.nodes, width = shape.inputs();
  for (int n = 0; n < nodes; ++n) {
    const bool turns = n % 3 == 0;
    for (int k = 0; k < width; ++k) {
      const double spread = k == 0 ? (turns ? 1 : 12) : (turns ? 15 : 1);
      weights[static_cast<std::size_t>(k * nodes + n)] = spread * normal(random);
    }
    weights[static_cast<std::size_t>(width * nodes + n)] = (turns ? 1 : 8) * normal(random);
  }
  return weights;
}

int solve(const FrictionNetwork::Shape& shape, const TrainingSet& data, int iterations_max,
          std::vector<double>& weights) {
  ceres::Problem problem;
  problem.AddResidualBlock(
      new NetworkCost(shape, scaled_inputs(shape, data.taps), data.force_N / shape.force_scale_N), nullptr,
      weights.data());
  ceres::Solver::Options options;
  options.trust_region_strategy_type = ceres::LEVENBERG_MARQUARDT;
  options.linear_solver_type = ceres::DENSE_NORMAL_CHOLESKY;
  options.max_num_iterations = iterations_max;
  options.function_tolerance = 1e-5;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  return static_cast<int>(summary.iterations.size());
}

// Samples of an axis that moves: of one that stands the network is not asked.
TrainingSet moving(const TrainingSet& all, double standing_mm) {
  std::vector<Eigen::Index> kept;
  // At rest friction may be anything up to its greatest value in either direction. Such samples would teach
  // the network noise.
  for (Eigen::Index i = 0; i < all.force_N.size(); ++i)
    if (std::abs(all.taps(1, i)) >= standing_mm) kept.push_back(i);
  return {all.taps(Eigen::all, kept), all.force_N(kept)};
}

void set_scales(FrictionNetwork::Shape& shape, const TrainingSet& data) {
  // The greatest values of the training also mark where the network knows something
  // (`FrictionNetwork::Output`).
  shape.position_scale_mm = data.taps.row(0).cwiseAbs().maxCoeff();
  shape.travel_scale_mm = data.taps.bottomRows(data.taps.rows() - 1).cwiseAbs().maxCoeff();
  shape.force_scale_N = data.force_N.cwiseAbs().maxCoeff();
}

}  // namespace

FrictionNetwork train_network(FrictionNetwork::Shape shape, const TrainingSet& all,
                              const TrainingSet& held_back, const TrainingOptions& options,
                              TrainingRecord& record) {
  const TrainingSet data = moving(all, shape.standing_mm);
  // Ten samples a weight: with fewer, a network learns the noise by heart and does well on its own data only.
  if (data.taps.rows() != shape.inputs() || data.force_N.size() < 10 * shape.weight_count())
    throw std::invalid_argument("too little data to train a network of this shape");
  set_scales(shape, data);
  std::mt19937_64 random(options.seed);
  FrictionNetwork best;
  double best_rms_N = std::numeric_limits<double>::infinity();
  record.iterations = 0;
  for (int start = 0; start < options.starts; ++start) {
    std::vector<double> weights = random_weights(shape, random);
    record.iterations += solve(shape, data, options.iterations_max, weights);
    const FrictionNetwork network(shape, weights);
    const double rms_N = network_error(network, held_back).rms_N;
    // The start is chosen by data that it was not trained on. Written so that a start that ran into NaN
    // loses.
    if (!(rms_N < best_rms_N)) continue;
    best_rms_N = rms_N;
    best = network;
  }
  record.method = "Levenberg-Marquardt";
  record.samples = static_cast<int>(data.force_N.size());
  record.starts = options.starts;
  const NetworkError trained = network_error(best, all), held = network_error(best, held_back);
  record.rms_training_N = trained.rms_N;
  record.explained_training = trained.explained;
  record.rms_validation_N = held.rms_N;
  record.explained_validation = held.explained;
  return best;
}

NetworkError network_error(const FrictionNetwork& network, const TrainingSet& set) {
  VectorXd error(set.force_N.size());
  for (Eigen::Index i = 0; i < error.size(); ++i)
    error[i] = set.force_N[i] - network.evaluate(set.taps.col(i)).force_N;
  const double n = static_cast<double>(error.size());
  const double variance = (set.force_N.array() - set.force_N.mean()).square().sum() / n;
  return {std::sqrt(error.squaredNorm() / n), 1 - error.squaredNorm() / n / variance};
}

}  // namespace trn
