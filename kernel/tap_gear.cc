#include "kernel/tap_gear.h"

#include <algorithm>
#include <cmath>

#include "core/check.h"

namespace trn {

namespace {
constexpr double kSecondsPerMinute = 60;
constexpr double kSpindleGain_s = 60, kPathGain_s = 40;  // 1/s
constexpr double kSlow = 0.1;            // of the full speed: below, plan time waits as it would there
constexpr double kRateMax = 1.2;         // of plan time, and of the full speed that the spindle is told
constexpr double kSettledTurns = 0.001;  // from their place, and a second
constexpr double kLostTurns = 0.25;
}  // namespace

void TapGear::begin(double turns, double turns_s, double per_turn_mm) TRN_RT {
  TRN_CHECK(turns_s != 0 && std::isfinite(turns_s));
  TRN_CHECK(per_turn_mm > 0);
  active_ = true;
  has_from_ = false;
  turns_from_ = wanted_ = wanted_before_ = turns;
  turns_s_ = turns_s;
  per_turn_mm_ = per_turn_mm;
  forward_ = turns_s < 0 ? -1 : 1;
  speed_ = 0;
}

double TapGear::rate(double turns) const TRN_RT {
  const double ahead = (turns - wanted_) * forward_;
  const double pace = std::max(std::abs(speed_), kSlow * std::abs(turns_s_));
  return std::clamp(1 + kPathGain_s * ahead / pace, 0.0, kRateMax);
}

// The first place is one period behind the start, which is nothing at a start from rest.
void TapGear::follow_tip(const Vec3& tip) TRN_RT {
  TRN_CHECK(tip.allFinite());
  if (!active_) return;
  if (!has_from_) from_ = tip;
  has_from_ = true;
  wanted_ = turns_from_ + std::copysign((tip - from_).norm() / per_turn_mm_, turns_s_);
}

double TapGear::spindle_rpm(double turns) TRN_RT {
  speed_ = (wanted_ - wanted_before_) / period_s_;
  if (speed_ != 0) forward_ = speed_ < 0 ? -1 : 1;
  const double most = kRateMax * std::abs(turns_s_);
  const double told = speed_ + kSpindleGain_s * (wanted_before_ - turns);
  wanted_before_ = wanted_;
  return kSecondsPerMinute * std::clamp(told, -most, most);
}

bool TapGear::settled(double turns) const TRN_RT {
  return std::abs(turns - wanted_) <= kSettledTurns && std::abs(speed_) <= kSettledTurns;
}

bool TapGear::lost(double turns) const TRN_RT {
  return active_ && std::abs(turns - wanted_before_) > kLostTurns;
}

}  // namespace trn
