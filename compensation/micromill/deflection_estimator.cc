#include "compensation/micromill/deflection_estimator.h"

#include <cmath>

namespace trn {

DeflectionEstimator::DeflectionEstimator(const Config& config)
    : config_(config),
      observers_{LoadObserver(config.axes[0].observer), LoadObserver(config.axes[1].observer)},
      window_share_(1 - std::exp(-config.period_s / config.alarm_window_s)) {}

void DeflectionEstimator::step(const Eigen::Vector2d& current_A, const Eigen::Vector2d& position_mm,
                               State& state, Output& out) const TRN_RT {
  out.known = true;
  out.alarm = false;
  for (int i = 0; i < 2; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Axis& axis = config_.axes[k];
    // The filter's load is everything that the current has to overcome. What the network knows of it,
    // friction and ripple, is not the cut's.
    observers_[k].step(current_A[i], position_mm[i], state.observer[k]);
    const DelayLine::Config& line = axis.network.shape().line;
    DelayLine::step(position_mm[i], state.line[k]);
    DelayLine::Taps taps;
    DelayLine::read(line, position_mm[i], state.line[k], taps);
    const FrictionNetwork::Output friction = axis.network.evaluate(taps);
    out.load_N[i] = state.observer[k].estimate[2];
    out.friction_N[i] = friction.force_N;
    // Both count against the plus direction. Their difference turned round is the force along plus, so a
    // positive deflection is a tool that bends towards plus.
    out.force_N[i] = friction.force_N - out.load_N[i];
    out.deflection_mm[i] = out.force_N[i] / axis.stiffness_N_mm;
    out.known = out.known && friction.known;
    const double innovation = state.observer[k].innovation_mm;
    // The mean over a window, since one measurement says nothing of a model. A stage that was learnt cold and
    // is warm now shows itself within tenths of a second.
    state.innovation_mm2[k] += window_share_ * (innovation * innovation - state.innovation_mm2[k]);
    out.innovation_rms_mm[i] = std::sqrt(state.innovation_mm2[k]);
    out.alarm = out.alarm || out.innovation_rms_mm[i] > axis.innovation_rms_max_mm;
  }
}

}  // namespace trn
