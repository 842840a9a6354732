#pragma once

#include "sim/canopen/object_store.h"

namespace trn {

/// What an emulated drive's numbers of speed and ramp are in counts, from its own objects (0x60A8 to 0x60AA,
/// 0x608F, 0x6091, 0x6092). Written from CiA 402-2 and CiA 303-2, apart from the master's reader.
struct EmulatedUnits {
  double counts_per_revolution = 0;  ///< where the objects do not say; 0: 1
  double counts_per_m = 0;
  double velocity = 1;      ///< counts/s of one unit where the drive has no 0x60A9
  double acceleration = 1;  ///< counts/s^2, where it has no 0x60AA

  double counts_s(const ObjectStore& store) const;
  double counts_s2(const ObjectStore& store) const;

 private:
  double counts(const ObjectStore& store, unsigned length) const;
};

}  // namespace trn
