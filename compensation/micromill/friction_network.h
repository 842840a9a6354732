#pragma once

#include <Eigen/Dense>
#include <array>
#include <string>
#include <vector>

#include "core/config.h"
#include "core/realtime.h"

namespace trn {

/// The two axes of an XY stage, in the order of everything that has one value for each.
inline constexpr const char* kStageAxes[] = {"X", "Y"};

/// Position of an axis through a tapped delay line.
class DelayLine {
 public:
  static constexpr int kDelaysMax = 6, kSpacingMax = 20;

  struct Config {
    int delays = 2;   ///< taps behind the first
    int spacing = 8;  ///< periods from tap to tap
  };
  struct State {
    std::array<double, kDelaysMax * kSpacingMax + 1> position_mm{};
    int newest = 0;
    bool started = false;
  };
  /// Position now, then the travel from tap to tap, newest first: the taps themselves in coordinates that
  /// do not depend on each other.
  using Taps = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kDelaysMax + 1, 1>;

  static void step(double position_mm, State& state) TRN_RT;
  static void read(const Config& config, double position_mm, const State& state, Taps& taps) TRN_RT;
};

/// Multilayer perceptron that knows the friction and force ripple of an axis (docs/sources.md S5.4): position
/// through a delay line, one or two hidden layers of sigmoid nodes, a linear output.
class FrictionNetwork {
 public:
  static constexpr int kNodesMax = 32, kLayersMax = 2;
  static constexpr int kInputsMax = DelayLine::kDelaysMax + 1;

  struct Shape {
    DelayLine::Config line;
    double standing_mm = 0.0015;  ///< an axis that travels less from tap to tap counts as standing
    int layers = 1;               ///< hidden ones
    int nodes = 16;               ///< in each
    double position_scale_mm = 1, travel_scale_mm = 1, force_scale_N = 1;  ///< of inputs and output

    int inputs() const { return line.delays + 1; }
    int weight_count() const;
  };
  struct Output {
    double force_N = 0;
    bool known = false;  ///< the inputs lie where the network was trained
  };

  FrictionNetwork() = default;
  /// `weights`: layer by layer, matrix (column-major) then bias; std::invalid_argument for a wrong count or a
  /// shape out of range.
  FrictionNetwork(const Shape& shape, const std::vector<double>& weights);

  /// Friction and ripple together. At rest the direction of friction is not known, and the cutter's rhythm
  /// shakes the axis loose. So below `standing_mm` of travel from tap to tap the answer lies between those of
  /// creeping up and of creeping down, in proportion to the travel.
  Output evaluate(const DelayLine::Taps& taps) const TRN_RT;
  /// What the perceptron alone says, N.
  double perceptron_N(const DelayLine::Taps& taps) const TRN_RT;
  const Shape& shape() const TRN_RT { return shape_; }
  std::vector<double> weights() const;

 private:
  using Nodes = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kNodesMax, 1>;
  struct Layer {
    Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kNodesMax, kNodesMax> matrix;
    Nodes bias;
  };

  Shape shape_;
  std::array<Layer, kLayersMax + 1> layers_;
};

/// How a network came to be; stands in its file.
struct TrainingRecord {
  std::string method, data;
  int samples = 0, iterations = 0, starts = 0;
  double rms_training_N = 0, explained_training = 0;
  double rms_validation_N = 0, explained_validation = 0;  ///< share of the variance, on runs never trained on
  double innovation_rms_mm = 0;                           ///< of the load filter during the training runs
};

/// The networks of a stage and what else was measured on it: one per axis, X and Y.
struct StageNetworks {
  std::array<FrictionNetwork, 2> network;
  std::array<TrainingRecord, 2> record;
};

/// Readable file (TOML) with a checksum over shapes and weights. Reading: ConfigError with file, line and
/// column for anything wrong, a checksum that does not fit included.
StageNetworks read_networks(const std::string& path);
/// The same from the root table of such a file.
StageNetworks read_networks(const ConfigTable& root);
/// std::runtime_error if it cannot be written.
void write_networks(const std::string& path, const StageNetworks& networks);

}  // namespace trn
