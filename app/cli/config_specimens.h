#pragma once

#include <string>
#include <vector>

#include "core/config_record.h"

namespace trn {

/// What all readers together asked one config for.
struct AskedSpecimen {
  std::string name;  ///< for messages
  ConfigRecord record;
};

/// Assembles machines of every kind, with every drive, correction and device there is, and notes what their
/// readers ask. Each machine is read twice, with other names and numbers, so that a default, range or choice
/// that follows from other keys shows as one that changes. Nothing is opened, and nothing moves. ConfigError
/// where a reader does not accept its specimen: then the specimen is behind the reader.
std::vector<AskedSpecimen> ask_all_readers();

}  // namespace trn
