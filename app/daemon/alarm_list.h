#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "app/daemon/supervisor.h"
#include "core/fault.h"
#include "hal/lcm_messages.h"

namespace trn {

/// The name of alarms about a program; those of faults are in the fault table.
inline constexpr const char* kProgramAlarm = "program";

/// Something that went wrong, as alarms_t tells it.
struct Alarm {
  std::string name, text, cure, did;
  std::string program;
  std::int32_t line = 0;
  std::string cause;
  bool active = false;  ///< it lasts
  // The list knows the rest.
  bool acknowledged = false;
  std::int64_t number = 0, since_us = 0;
  std::int32_t times = 1;
};

/// A fault of the table as an alarm that lasts. `detail`: what its source says besides; `before`: the state
/// in which it came.
Alarm fault_alarm(Fault fault, const std::string& joint, const std::string& detail, MachineState before);

/// What went wrong, oldest first: each stays until it is over and somebody has acknowledged it.
class AlarmList {
 public:
  static constexpr std::size_t kMax = 32;

  /// One that is listed already with the same name and text, and not yet acknowledged, came once more.
  void raise(Alarm alarm);
  /// Those with this name are over; "": all.
  void over(std::string_view name = {});
  /// The one with this number, 0: all. False if there is none.
  bool acknowledge(std::int64_t number);

  const std::vector<Alarm>& alarms() const { return alarms_; }
  int open() const;
  /// The newest that nobody has acknowledged, for people; "" if none.
  std::string newest() const;
  trunnion::alarms_t message() const;
  /// True once after each change.
  bool take_news();

 private:
  void forget();

  std::vector<Alarm> alarms_;
  std::int64_t count_ = 0;
  bool news_ = false;
};

}  // namespace trn
