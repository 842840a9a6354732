#pragma once

#include <string>

#include "app/import/import_place.h"

namespace trn {

/// The kinematics module of a configuration: its name, its arguments, and what each of its joints is.
struct KinematicsModule {
  std::string name = {};
  std::string letters = {};  ///< the axis letter of each joint, from joint 0 on; "" for a hexapod
  bool identity_first = false;
  ImportPlace place = {};
};

}  // namespace trn
