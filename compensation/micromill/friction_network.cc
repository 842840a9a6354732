#include "compensation/micromill/friction_network.h"

#include <cmath>
#include <stdexcept>

namespace trn {

namespace {
constexpr double kKnownMargin = 1.1;  // beyond the trained range by so much is still known
}

void DelayLine::step(double position_mm, State& state) TRN_RT {
  // An axis that is heard for the first time counts as one that stood there all along. A line full of zeros
  // would look like a leap from the origin.
  if (!state.started) state.position_mm.fill(position_mm);
  state.started = true;
  state.newest = (state.newest + 1) % static_cast<int>(state.position_mm.size());
  state.position_mm[static_cast<std::size_t>(state.newest)] = position_mm;
}

void DelayLine::read(const Config& config, double position_mm, const State& state, Taps& taps) TRN_RT {
  const int size = static_cast<int>(state.position_mm.size());
  taps.resize(config.delays + 1);
  taps[0] = position_mm;
  double before = state.position_mm[static_cast<std::size_t>(state.newest)];
  for (int i = 1; i <= config.delays; ++i) {
    const int at = (state.newest + size - i * config.spacing) % size;
    const double tap = state.position_mm[static_cast<std::size_t>(at)];
    // Three places of an axis that moves slowly are nearly the same number. Their differences carry the
    // speed, which friction depends on, and the weights need not find them by subtracting large numbers.
    taps[i] = before - tap;
    before = tap;
  }
}

int FrictionNetwork::Shape::weight_count() const {
  int count = 0, width = inputs();
  for (int layer = 0; layer < layers; ++layer, width = nodes) count += nodes * (width + 1);
  return count + width + 1;
}

FrictionNetwork::FrictionNetwork(const Shape& shape, const std::vector<double>& weights) : shape_(shape) {
  const bool legal = shape.layers >= 1 && shape.layers <= kLayersMax && shape.nodes >= 1 &&
                     shape.nodes <= kNodesMax && shape.line.delays >= 1 &&
                     shape.line.delays <= DelayLine::kDelaysMax && shape.line.spacing >= 1 &&
                     shape.line.spacing <= DelayLine::kSpacingMax;
  if (!legal) throw std::invalid_argument("a network of this shape is not supported");
  if (static_cast<int>(weights.size()) != shape.weight_count())
    throw std::invalid_argument("the number of weights does not fit the network's shape");
  const double* at = weights.data();
  int width = shape.inputs();
  for (int i = 0; i <= shape.layers; ++i) {
    Layer& layer = layers_[static_cast<std::size_t>(i)];
    const int rows = i < shape.layers ? shape.nodes : 1;
    layer.matrix = Eigen::Map<const Eigen::MatrixXd>(at, rows, width);
    layer.bias = Eigen::Map<const Eigen::VectorXd>(at + rows * width, rows);
    at += rows * (width + 1);
    width = rows;
  }
}

double FrictionNetwork::perceptron_N(const DelayLine::Taps& taps) const TRN_RT {
  Nodes x = taps / shape_.travel_scale_mm;
  // The inputs come to between -1 and 1, where the sigmoids are neither flat nor all alike.
  x[0] = taps[0] / shape_.position_scale_mm;
  for (int i = 0; i < shape_.layers; ++i) {
    const Layer& layer = layers_[static_cast<std::size_t>(i)];
    Nodes sum = layer.bias;
    sum.noalias() += layer.matrix.lazyProduct(x);
    x = (1 + (-sum.array()).exp()).inverse();
  }
  const Layer& last = layers_[static_cast<std::size_t>(shape_.layers)];
  return shape_.force_scale_N * (last.matrix.row(0).dot(x.transpose()) + last.bias[0]);
}

FrictionNetwork::Output FrictionNetwork::evaluate(const DelayLine::Taps& taps) const TRN_RT {
  Output out;
  if (layers_[0].matrix.size() == 0) return out;  // knows nothing yet
  const double travel = taps.tail(taps.size() - 1).cwiseAbs().maxCoeff();
  out.known = std::abs(taps[0]) <= kKnownMargin * shape_.position_scale_mm &&
              travel <= kKnownMargin * shape_.travel_scale_mm;
  // Between creeping down and creeping up the friction turns round. In between the answer is drawn as a
  // straight line, so it is continuous and passes through the mean at rest.
  const double creep = shape_.standing_mm;
  if (!(std::abs(taps[1]) < creep)) {
    out.force_N = perceptron_N(taps);
    return out;
  }
  DelayLine::Taps way = DelayLine::Taps::Constant(taps.size(), creep);
  way[0] = taps[0];
  const double up_N = perceptron_N(way);
  // The place stays: ripple depends on it and not on the direction.
  way.tail(way.size() - 1) *= -1;
  const double down_N = perceptron_N(way);
  out.force_N = (up_N + down_N) / 2 + taps[1] / creep * (up_N - down_N) / 2;
  return out;
}

std::vector<double> FrictionNetwork::weights() const {
  std::vector<double> out;
  for (int i = 0; i <= shape_.layers; ++i) {
    const Layer& layer = layers_[static_cast<std::size_t>(i)];
    out.insert(out.end(), layer.matrix.data(), layer.matrix.data() + layer.matrix.size());
    out.insert(out.end(), layer.bias.data(), layer.bias.data() + layer.bias.size());
  }
  return out;
}

}  // namespace trn
