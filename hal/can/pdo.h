#pragma once

#include <cstdint>
#include <vector>

#include "hal/can/eds.h"
#include "hal/can/frame.h"
#include "hal/can/sdo.h"

namespace trn {

/// One object in a PDO.
struct PdoField {
  ObjectKey key;
  int bits = 0;
  int byte = 0;  ///< where it begins

  std::uint32_t mapping() const {  ///< as in 0x1600.., CiA 301, 7.5.2.36
    return static_cast<std::uint32_t>(key.index) << 16 | static_cast<std::uint32_t>(key.sub) << 8 |
           static_cast<std::uint32_t>(bits);
  }
};

/// A process data object: which objects its bytes are.
struct Pdo {
  std::uint32_t id = 0;
  std::uint16_t number = 0;       ///< 0 to 3; communication record 0x1400 (0x1800) + number
  std::uint8_t transmission = 1;  ///< 1: with every SYNC (CiA 301, 7.5.2.35); 255: on an event
  int every = 1;                  ///< of an RPDO: sent once in so many periods
  bool fd = false;                ///< in CAN FD frames
  std::vector<PdoField> fields;

  int size() const TRN_RT;
  int frame_size() const TRN_RT { return fd ? fd_size(size()) : size(); }
};

/// Puts objects into as few PDOs as they need, in order; a PDO has 8 bytes, over FD 64 (CiA 1301). `receive`:
/// towards the node. Sizes come from `dictionary`; EdsError that names the object if it is not there, cannot
/// be mapped, is read-only (receive) or has no fixed size, or if more than four PDOs would be needed.
std::vector<Pdo> plan_pdos(const ObjectDictionary& dictionary, const std::vector<ObjectKey>& objects,
                           bool receive, int node, bool fd = false);

/// Where `key` lies among `pdos`; false if it is not mapped.
bool find_field(const std::vector<Pdo>& pdos, ObjectKey key, int& pdo, PdoField& field);

}  // namespace trn
