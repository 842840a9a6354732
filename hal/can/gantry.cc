#include "hal/can/gantry.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

Gantry::Gantry(const Config& config) : config_(config) {
  TRN_CHECK(config.motors >= 2 && config.motors <= kMotorsMax);
}

void Gantry::advance() TRN_RT {
  if (phase_ == Phase::kSquaring) {
    const bool square = move_.step(0, config_.squaring);
    for (std::size_t i = 0; i < offset_.size(); ++i)
      offset_[i] = offset_max_ > 0 ? paired_[i] * (move_.place() / offset_max_) : 0;
    if (!square) return;
    const bool goes_on = homed_now_ && std::isfinite(config_.home_final);
    phase_ = goes_on ? Phase::kFinal : Phase::kReady;
    move_.begin(mean_);
  } else if (phase_ == Phase::kFinal) {
    const bool there = move_.step(config_.home_final, config_.final);
    if (there && std::abs(mean_ - config_.home_final) <= config_.near) phase_ = Phase::kReady;
  }
}

Gantry::Demand Gantry::demand(int i, double q, double qd, bool follow) const TRN_RT {
  TRN_CHECK(i >= 0 && i < config_.motors);
  const auto at = static_cast<std::size_t>(i);
  switch (phase_) {
    case Phase::kSquaring:
      return {base_ + offset_[at], offset_max_ > 0 ? move_.speed() * paired_[at] / offset_max_ : 0, true};
    case Phase::kFinal:
      return {move_.place(), move_.speed(), true};
    case Phase::kPaired:
    case Phase::kReady:
      return {q + offset_[at], qd, follow};
    case Phase::kOff:
    case Phase::kSearching:
      break;
  }
  return {q, 0, false};
}

double Gantry::spread(const std::array<double, kMotorsMax>& places) const TRN_RT {
  const auto end = places.begin() + config_.motors;
  return *std::max_element(places.begin(), end) - *std::min_element(places.begin(), end);
}

void Gantry::pair(const Motors& motors) TRN_RT {
  base_ = mean_;
  offset_max_ = 0;
  for (int i = 0; i < config_.motors; ++i) {
    const auto at = static_cast<std::size_t>(i);
    paired_[at] = offset_[at] = motors[at].q - mean_;
    offset_max_ = std::max(offset_max_, std::abs(paired_[at]));
  }
}

void Gantry::begin_squaring(bool homed_now) TRN_RT {
  homed_now_ = homed_now;
  phase_ = Phase::kSquaring;
  move_.begin(offset_max_);
}

// By the ways that they go: when a drive finds its zero, its position jumps.
void Gantry::search(const Motors& motors) TRN_RT {
  for (int i = 0; i < config_.motors; ++i) {
    const auto at = static_cast<std::size_t>(i);
    const double step = motors[at].q - before_[at];
    if (std::abs(step) <= config_.step_max) travel_[at] += step;
  }
  apart_ = spread(travel_);
}

void Gantry::change_phase(const Motors& motors) TRN_RT {
  const auto end = motors.begin() + config_.motors;
  const auto all = [&](auto is) TRN_RT { return std::all_of(motors.begin(), end, is); };
  const bool homing = std::any_of(motors.begin(), end, [](const Motor& motor) { return motor.homing; });
  const bool homed = all([](const Motor& motor) { return motor.homed; });
  if (!all([](const Motor& motor) { return motor.enabled || motor.homing; })) {
    phase_ = Phase::kOff;
  } else if (homing && phase_ != Phase::kSearching) {
    // From where they stand: a gantry that was paired askew may search until it is askew by its limit.
    phase_ = Phase::kSearching;
    travel_ = {};
  } else if (!homing && (phase_ == Phase::kOff || phase_ == Phase::kSearching)) {
    const bool searched = phase_ == Phase::kSearching;
    pair(motors);
    phase_ = Phase::kPaired;
    if (homed) begin_squaring(searched);
  }
}

bool Gantry::observe(const Motors& motors) TRN_RT {
  mean_ = apart_ = 0;
  for (int i = 0; i < config_.motors; ++i) mean_ += motors[static_cast<std::size_t>(i)].q / config_.motors;
  change_phase(motors);
  if (phase_ == Phase::kSearching) {
    search(motors);
  } else if (phase_ != Phase::kOff) {
    std::array<double, kMotorsMax> places{};
    for (std::size_t i = 0; i < places.size(); ++i) places[i] = motors[i].q - offset_[i];
    apart_ = spread(places);
  }
  for (std::size_t i = 0; i < before_.size(); ++i) before_[i] = motors[i].q;
  return apart_ <= (phase_ == Phase::kSearching ? config_.apart_homing_max : config_.apart_max);
}

DriveState Gantry::state() const TRN_RT {
  switch (phase_) {
    case Phase::kOff:
      return DriveState::kStarting;
    case Phase::kSearching:
    case Phase::kFinal:
      return DriveState::kHoming;
    case Phase::kSquaring:
      return homed_now_ ? DriveState::kHoming : DriveState::kStarting;
    case Phase::kPaired:
    case Phase::kReady:
      break;
  }
  return DriveState::kEnabled;
}

}  // namespace trn
