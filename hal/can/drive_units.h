#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <vector>

#include "hal/can/eds.h"
#include "hal/can/sdo.h"

namespace trn {

/// In which units a drive takes and tells speeds and ramps (CiA 402-2, objects 0x60A8 to 0x60AA; codes of
/// CiA 303-2), as seen from its counts.
struct DriveUnits {
  /// What the drive must hold for it; a data sheet that allows it has it written, else it is compared.
  struct Object {
    ObjectKey key;
    std::int64_t value = 0;
    bool written = false;
  };

  double velocity = 1;               ///< of the drive's units for one count/s
  double acceleration = 1;           ///< of the drive's units for one count/s^2
  double counts_per_motor_turn = 0;  ///< 0: not known
  std::vector<Object> objects;

  /// At most `counts_s`, in the drive's whole numbers; 0 if one of them is faster already.
  std::int64_t velocity_at_most(double counts_s) const;
  std::int64_t acceleration_of(double counts_s2) const;
};

/// What the config says of it; "" and 0: the data sheet does.
struct DriveUnitWish {
  std::string velocity, acceleration;  ///< "rpm", "0.1 rpm", "counts/s"; "rpm/s", "counts/s^2"
  double counts_per_revolution = 0;    ///< of the motor or, with a gear, of the shaft behind it
  double counts_per_m = 0;             ///< of a linear axis; 0: it is a rotary one
};

/// A unit that cannot be had; `key` is the config's that would help.
struct DriveUnitError : std::runtime_error {
  DriveUnitError(std::string the_key, const std::string& what)
      : std::runtime_error(what), key(std::move(the_key)) {}
  std::string key;
};

/// The config's word goes before the DCF's value, that before the data sheet's default; without any a drive
/// counts in counts/s, and ramps in its unit of velocity per second. DriveUnitError.
DriveUnits drive_units(const DriveUnitWish& wish, const ObjectDictionary& dictionary);

}  // namespace trn
