#pragma once

#include <set>
#include <string>

#include "compensation/sensor_board.h"
#include "hal/lcm_messages.h"

namespace trn {

/// A name that anybody may have sent, fit for the log: 40 characters at most, others than printable ASCII as
/// '?'.
std::string shown_name(const std::string& name);

/// Hands readings on to the corrections that want them; who sends others is told once.
class SensorReceiver {
 public:
  /// The board must outlive it.
  explicit SensorReceiver(SensorBoard& board) : board_(board) {}
  /// `stranger`: who sent them, if that is somebody who may not; "" if it is not.
  void receive(const trunnion::sensor_t& readings, const std::string& stranger = "");

 private:
  SensorBoard& board_;
  std::set<std::string> unknown_;
  bool told_stranger_ = false;
};

}  // namespace trn
