#include "sim/simulated_spindle.h"

#include <algorithm>
#include <cmath>

#include "core/units.h"

namespace trn {

namespace {
constexpr double kSecondsPerMinute = 60;
constexpr double kReadyShare = 0.01;  // of the speed that was told
constexpr double kOrientRpm = 30;     // at which it looks for its place
constexpr double kDegPerTurn = 360;
constexpr double kDegAtPlace = 1e-6;
}  // namespace

void SimulatedSpindle::step(const IoOutputs& outputs, IoInputs& inputs) TRN_RT {
  time_s_ += config_.period_s;
  if (outputs.spindle_geared) {
    inputs.spindle_ready = gear(outputs.spindle_turns);
  } else if (outputs.spindle_orients) {
    inputs.spindle_ready = orient(outputs.spindle_deg);
  } else {
    turn(outputs.spindle_rpm);
    inputs.spindle_ready =
        std::abs(rpm_ - outputs.spindle_rpm) <= kReadyShare * std::abs(outputs.spindle_rpm);
  }
  geared_ = outputs.spindle_geared;
  inputs.spindle_turns = turns_;
}

void SimulatedSpindle::turn(double rpm) TRN_RT {
  const double step = config_.acceleration_rpm_s * config_.period_s;
  rpm_ = step > 0 ? std::clamp(rpm, rpm_ - step, rpm_ + step) : rpm;
  const double wave = config_.load_share * std::sin(2 * kPi * config_.load_hz * time_s_);
  turns_ += rpm_ * (1 + wave) / kSecondsPerMinute * config_.period_s;
}

// Slows down, then goes on slowly to the place.
bool SimulatedSpindle::orient(double deg) TRN_RT {
  if (std::abs(rpm_) > kOrientRpm) {
    turn(0);
    return false;
  }
  const double to_go = std::remainder(deg - kDegPerTurn * turns_, kDegPerTurn) / kDegPerTurn;
  const double step = kOrientRpm / kSecondsPerMinute * config_.period_s;
  turns_ += std::clamp(to_go, -step, step);
  rpm_ = 0;
  return std::abs(to_go) * kDegPerTurn <= kDegAtPlace;
}

// A servo: follows the turns it is told without lag.
bool SimulatedSpindle::gear(double turns) TRN_RT {
  if (!geared_) geared_from_ = turns_ - turns;
  const double before = turns_;
  turns_ = geared_from_ + turns;
  rpm_ = (turns_ - before) / config_.period_s * kSecondsPerMinute;
  return true;
}

}  // namespace trn
