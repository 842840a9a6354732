#include "sim/servo_mechanism.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

namespace {
constexpr double kLoopS = 62.5e-6;        // between two steps of a drive's own loops
constexpr double kStepsOfResonance = 40;  // in one swing
}  // namespace

ServoMechanism::ServoMechanism(const Config& config) : config_(config) {
  double step_s = kLoopS;
  if (config.resonance_rad_s > 0)
    step_s = std::min(step_s, 2 * 3.14159265358979 / config.resonance_rad_s / kStepsOfResonance);
  steps_ = std::max(1, static_cast<int>(std::ceil(config.period_s / step_s - 1e-9)));
  dt_ = config.period_s / steps_;
  load_inertia_ = config.resonance_rad_s > 0 ? config.inertia * config.load_share : 0;
  motor_inertia_ = config.inertia - load_inertia_;
  if (load_inertia_ <= 0) return;
  // Two masses on a spring swing against each other with w^2 = k (1/m + 1/M).
  const double reduced = motor_inertia_ * load_inertia_ / config.inertia;
  stiffness_ = reduced * config.resonance_rad_s * config.resonance_rad_s;
  spring_damping_ = 2 * config.resonance_damping * config.resonance_rad_s * reduced;
}

void ServoMechanism::step(double from, double to, const Reference& reference, State& state) const TRN_RT {
  TRN_CHECK(config_.inertia > 0 && dt_ > 0);
  // The drive compares place and target of one moment, the beginning of the step.
  for (int i = 0; i < steps_; ++i) {
    const double target = from + (to - from) * i / steps_;
    state.force = wanted_force(target, reference, state);
    move(state.force, state);
  }
}

double ServoMechanism::wanted_force(double target, const Reference& reference, State& state) const TRN_RT {
  using Loop = Reference::Loop;
  double force = reference.force;
  if (reference.loop != Loop::kTorque) {
    const double from_place =
        reference.loop == Loop::kPosition ? config_.position_gain_1_s * (target - state.x) : 0;
    const double error = from_place + reference.velocity - state.v;
    const double integral =
        config_.integral_time_s > 0 ? config_.velocity_gain * error * dt_ / config_.integral_time_s : 0;
    force += config_.velocity_gain * error + state.integral;
    // At the limit of its current the drive does not wind up.
    if (config_.force_max <= 0 || std::abs(force) < config_.force_max) state.integral += integral;
  }
  return config_.force_max > 0 ? std::clamp(force, -config_.force_max, config_.force_max) : force;
}

double ServoMechanism::weight_at(double x) const TRN_RT {
  const double turning = config_.imbalance != 0 ? config_.imbalance * std::cos(x - config_.imbalance_at) : 0;
  return config_.gravity + turning;
}

// Of the motor: what holds it against its magnets.
double ServoMechanism::cogging_at(double x) const TRN_RT {
  double sum = 0;
  if (config_.cogging_pitch <= 0) return sum;
  for (std::size_t i = 0; i < kCoggingWaves; ++i) {
    const double turns = static_cast<double>(i + 1) * (x - config_.cogging_at[i]) / config_.cogging_pitch;
    if (config_.cogging[i] != 0) sum += config_.cogging[i] * std::cos(2 * 3.14159265358979 * turns);
  }
  return sum;
}

// Friction takes speed until there is none left; it never turns a motion round.
double ServoMechanism::slowed(double v, double inertia) const TRN_RT {
  const double after_viscous = v / (1 + config_.viscous * dt_ / inertia);
  const double taken = config_.coulomb * dt_ / inertia;
  return std::abs(after_viscous) <= taken ? 0 : after_viscous - std::copysign(taken, after_viscous);
}

// Semi-implicit Euler: speed first, then the place by the new speed.
void ServoMechanism::move(double force, State& state) const TRN_RT {
  if (load_inertia_ <= 0) {
    state.v = slowed(state.v + (force - weight_at(state.x) - cogging_at(state.x)) * dt_ / config_.inertia,
                     config_.inertia);
    state.x += state.v * dt_;
    state.load_x = state.x;
    state.load_v = state.v;
    return;
  }
  const double apart = state.x - state.load_x, gap = config_.backlash / 2;
  const double stretched = std::abs(apart) <= gap ? 0 : apart - std::copysign(gap, apart);
  const double damping = stretched != 0 ? spring_damping_ * (state.v - state.load_v) : 0;
  const double spring = stiffness_ * stretched + damping;
  state.v += (force - spring - cogging_at(state.x)) * dt_ / motor_inertia_;
  state.load_v =
      slowed(state.load_v + (spring - weight_at(state.load_x)) * dt_ / load_inertia_, load_inertia_);
  state.x += state.v * dt_;
  state.load_x += state.load_v * dt_;
}

}  // namespace trn
