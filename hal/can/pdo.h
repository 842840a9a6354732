#pragma once

#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

#include "hal/can/eds.h"
#include "hal/can/frame.h"
#include "hal/can/sdo.h"

namespace trn {

/// What a PDO is told when it is mapped anew (CiA 301, 7.5.2.35 to 7.5.2.38): it is switched off, its
/// transmission type, no objects, which ones, how many, it is switched on.
enum class PdoWrite : std::uint8_t { kOff, kType, kClear, kMap, kCount, kOn };
inline constexpr int kPdoWrites = 6;
using PdoOrder = std::array<PdoWrite, kPdoWrites>;
/// "off" and so on, as the config has them.
std::string_view to_string(PdoWrite write);

/// What drives want otherwise than most when their PDOs are mapped.
struct PdoHabits {
  PdoOrder order = {PdoWrite::kOff, PdoWrite::kType,  PdoWrite::kClear,
                    PdoWrite::kMap, PdoWrite::kCount, PdoWrite::kOn};
  bool strict = false;                        ///< it refuses another order; else that of the standard will do
  unsigned fixed_rpdos = 0, fixed_tpdos = 0;  ///< bit 0: the first carries what it carries
  bool fixed(bool receive, int number) const {
    return ((receive ? fixed_rpdos : fixed_tpdos) >> number & 1u) != 0;
  }
};

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
  bool fixed = false;  ///< its objects are the drive's own, and are not written

  int size() const TRN_RT;
  int frame_size() const TRN_RT { return fd ? fd_size(size()) : size(); }
};

/// Puts objects into as few PDOs as they need, in order; a PDO has 8 bytes, over FD 64 (CiA 1301). `receive`:
/// towards the node. Sizes come from `dictionary`; EdsError that names the object if it is not there, cannot
/// be mapped, is read-only (receive) or has no fixed size, or if more than four PDOs would be needed. Fixed
/// PDOs carry what the data sheet says; EdsError if that does not say it, or if the node would be sent what
/// nothing here sets.
std::vector<Pdo> plan_pdos(const ObjectDictionary& dictionary, const std::vector<ObjectKey>& objects,
                           bool receive, int node, bool fd = false, const PdoHabits& habits = {});

/// Where `key` lies among `pdos`; false if it is not mapped.
bool find_field(const std::vector<Pdo>& pdos, ObjectKey key, int& pdo, PdoField& field);

}  // namespace trn
