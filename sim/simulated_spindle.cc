#include "sim/simulated_spindle.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"
#include "core/units.h"

namespace trn {

namespace {
constexpr double kSecondsPerMinute = 60;
constexpr double kReadyShare = 0.01;  // of the speed that was told
constexpr double kOrientRpm = 30;     // at which it looks for its place
constexpr double kDegPerTurn = 360;
constexpr double kDegAtPlace = 1e-6;
}  // namespace

// The exact share of a first-order lag over a period. The period over the lag would swing past the speed
// where the lag is the shorter.
SimulatedSpindle::SimulatedSpindle(const Config& config)
    : config_(config), follows_(config.lag_s > 0 ? -std::expm1(-config.period_s / config.lag_s) : 1) {}

void SimulatedSpindle::step(const IoOutputs& outputs, IoInputs& inputs) TRN_RT {
  time_s_ += config_.period_s;
  if (outputs.spindle_orients) {
    inputs.spindle_ready = orient(outputs.spindle_deg);
  } else {
    turn(outputs.spindle_rpm);
    inputs.spindle_ready =
        std::abs(rpm_ - outputs.spindle_rpm) <= kReadyShare * std::abs(outputs.spindle_rpm);
  }
  inputs.spindle_turns = turns_;
}

void SimulatedSpindle::turn(double rpm) TRN_RT {
  TRN_CHECK(follows_ > 0 && follows_ <= 1);
  const double step = config_.acceleration_rpm_s * config_.period_s;
  aim_rpm_ = step > 0 ? std::clamp(rpm, aim_rpm_ - step, aim_rpm_ + step) : rpm;
  rpm_ += follows_ * (aim_rpm_ - rpm_);
  // Under load a spindle swings about its speed: a thread must follow its turns and not the speed that was
  // told.
  const double wave = config_.load_share * std::sin(2 * kPi * config_.load_hz * time_s_);
  turns_ += rpm_ * (1 + wave) / kSecondsPerMinute * config_.period_s;
}

// Slows down, then goes on slowly to the place.
bool SimulatedSpindle::orient(double deg) TRN_RT {
  if (std::abs(rpm_) > kOrientRpm) {
    turn(0);
    return false;
  }
  // The shorter way round, at most half a turn.
  const double to_go = std::remainder(deg - kDegPerTurn * turns_, kDegPerTurn) / kDegPerTurn;
  const double step = kOrientRpm / kSecondsPerMinute * config_.period_s;
  turns_ += std::clamp(to_go, -step, step);
  rpm_ = aim_rpm_ = 0;
  return std::abs(to_go) * kDegPerTurn <= kDegAtPlace;
}

}  // namespace trn
