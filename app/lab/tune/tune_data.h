#pragma once

#include <cstddef>
#include <limits>
#include <vector>

namespace trn {

/// One motion of a joint for its measurement: there by `way`, at `speed`; mm or rad, per s.
struct TuneStroke {
  double way = 0, speed = 0;
};

/// What a joint did, period by period. Setpoints stand beside the measurement that belongs to them.
struct TuneData {
  double period_s = 0;
  std::vector<double> setpoint, measured;  ///< mm or rad
  std::vector<double> force;               ///< N or Nm, of the motor
  std::vector<int> stroke;                 ///< which one; -1: none yet
  std::vector<double> stirred;             ///< N or Nm that the drive was told beside; empty: never any
  int first_stirred = std::numeric_limits<int>::max();  ///< the stroke from which on it was

  std::size_t rows() const { return measured.size(); }
};

}  // namespace trn
