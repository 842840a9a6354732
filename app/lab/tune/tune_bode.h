#pragma once

#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "app/lab/tune/tune_data.h"
#include "app/lab/tune/tune_fit.h"
#include "app/lab/tune/tune_stirred.h"
#include "core/axes.h"

namespace trn {

/// A frequency response by cross spectra (Welch 1967), with how far it is to be trusted.
struct FrequencyResponse {
  std::vector<double> hz;
  std::vector<std::complex<double>> h;
  std::vector<double> coherence;  ///< 0 to 1
};

/// What the loop of a drive does, by what it was told and what it told.
struct TuneLoop {
  FrequencyResponse closed;  ///< from the setpoint's velocity to the measured one
  FrequencyResponse
      mechanics;  ///< from the force that moves masses to acceleration, over the inertia: 1 is rigid
  std::optional<double> bandwidth_hz;  ///< the closed loop is 3 dB down, or 90 degrees late
  double seen_up_to_hz = 0;            ///< beyond, the motions had too little in them to tell
  std::optional<StirredLoop> stirred;  ///< where the motor was shaken
  std::optional<double> swing_hz;      ///< load against a motor that is held (a dip of the mechanics)
  std::optional<double> resonance_hz;  ///< load against a free motor (a peak)
};

TuneLoop measure_loop(const TuneData& data, const TuneFit& fit, const Joint& joint);

/// The jerk with which the acceleration's ramp lasts one swing of the load, so that it leaves no swing behind
/// (mm or rad per s^3): acceleration times frequency. Nothing where nothing swings.
std::optional<double> recommended_jerk(const TuneLoop& loop, const Joint& joint);

/// Both responses as a picture.
std::string bode_svg(const TuneLoop& loop, const Joint& joint);

}  // namespace trn
