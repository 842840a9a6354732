#pragma once

#include <cstdint>
#include <vector>

#include "compensation/micromill/friction_network.h"

namespace trn {

/// Inputs and target of a network, one column (inputs) and entry (N) per sample.
struct TrainingSet {
  Eigen::MatrixXd taps;
  Eigen::VectorXd force_N;
};

struct TrainingOptions {
  int starts = 3;  ///< random starting points, of which the one that does best on `held_back` is kept
  int iterations_max = 150;
  std::uint64_t seed = 1;
};

/// Trains a network of `shape` (its scales are set here, from the data) by Levenberg-Marquardt (Ceres) on
/// `data`; `record` gets samples, iterations and errors on both sets. Both sets must have the shape's number
/// of taps and at least ten samples per weight; std::invalid_argument otherwise.
FrictionNetwork train_network(FrictionNetwork::Shape shape, const TrainingSet& data,
                              const TrainingSet& held_back, const TrainingOptions& options,
                              TrainingRecord& record);

/// Error of a network on a set: root mean square, N, and share of the target's variance that it explains.
struct NetworkError {
  double rms_N = 0, explained = 0;
};
NetworkError network_error(const FrictionNetwork& network, const TrainingSet& set);

}  // namespace trn
