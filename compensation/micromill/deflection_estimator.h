#pragma once

#include <array>

#include "compensation/micromill/friction_network.h"
#include "compensation/micromill/load_observer.h"

namespace trn {

/// From what the drives of two linear motors tell, every period: the force on the tool and how far the tool
/// bends (docs/sources.md S5.5). Index 0 is X, 1 is Y; joint coordinates (the tool's place over the work).
class DeflectionEstimator {
 public:
  struct Axis {
    LoadObserver::Config observer;
    FrictionNetwork network;
    double stiffness_N_mm = 0;         ///< k_t of the tool along this axis
    double innovation_rms_max_mm = 0;  ///< above it the model no longer fits
  };
  struct Config {
    std::array<Axis, 2> axes;
    double period_s = 0;
    double alarm_window_s = 0.1;  ///< over which the innovation is averaged
  };
  struct State {
    std::array<LoadObserver::State, 2> observer;
    std::array<DelayLine::State, 2> line;
    std::array<double, 2> innovation_mm2{};  ///< mean square
  };
  struct Output {
    Eigen::Vector2d load_N = Eigen::Vector2d::Zero();         ///< all that loads the motors, against plus
    Eigen::Vector2d friction_N = Eigen::Vector2d::Zero();     ///< of it, friction and ripple as learnt
    Eigen::Vector2d force_N = Eigen::Vector2d::Zero();        ///< on the tool
    Eigen::Vector2d deflection_mm = Eigen::Vector2d::Zero();  ///< of the tool's tip
    Eigen::Vector2d innovation_rms_mm = Eigen::Vector2d::Zero();
    bool known = false;  ///< place and speed lie where the networks were trained
    bool alarm = false;  ///< the innovation is larger than the model explains
  };

  explicit DeflectionEstimator(const Config& config);

  /// One period: mean currents during it (A), positions at its end (mm).
  void step(const Eigen::Vector2d& current_A, const Eigen::Vector2d& position_mm, State& state,
            Output& out) const TRN_RT;

  const Config& config() const { return config_; }
  const LoadObserver& observer(int axis) const { return observers_[static_cast<std::size_t>(axis)]; }

 private:
  Config config_;
  std::array<LoadObserver, 2> observers_;
  double window_share_ = 0;
};

}  // namespace trn
