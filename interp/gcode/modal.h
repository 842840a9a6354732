#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "interp/gcode/g_code.h"

namespace trn {

/// Modal groups of the G codes (NIST RS274/NGC table 4, with the dialect's additions).
enum class GGroup : std::uint8_t {
  kNonModal,
  kMotion,
  kPlane,
  kDistance,
  kArcDistance,
  kFeedMode,
  kUnits,
  kCutterComp,
  kToolLength,
  kRetract,
  kWorkOffset,
  kPath,
  kSpindleMode,
  kDiameter,
  kTiltedPlane,
  kIgnored,  ///< of the config: it means nothing here
  kCount
};
inline constexpr std::size_t kGGroupCount = static_cast<std::size_t>(GGroup::kCount);

enum class MGroup : std::uint8_t {
  kStop,
  kToolChange,
  kSpindle,
  kCoolant,
  kOverride,
  kOutput,
  kState,
  kSub,
  kRtcp,
  kUser,
  kIgnored,
  kCount
};
inline constexpr std::size_t kMGroupCount = static_cast<std::size_t>(MGroup::kCount);

/// Which code belongs to which group; -1 for a code that does not exist.
class ModalTable {
 public:
  ModalTable();

  /// Index of a GGroup, or -1.
  int g_group(GCode code) const { return in_range(code) ? g_[static_cast<std::size_t>(tenths(code))] : -1; }
  /// Index of an MGroup, or -1.
  int m_group(int code) const {
    return code >= 0 && code < kMCodes ? m_[static_cast<std::size_t>(code)] : -1;
  }

  /// Gives a G code of the config, in range, a group.
  void map_g(GCode code, GGroup group) {
    g_[static_cast<std::size_t>(tenths(code))] = static_cast<std::int8_t>(group);
  }
  /// Gives an M code of the config, below kMCodes, a group (RTCP words, user codes).
  void map_m(int code, MGroup group) { m_[static_cast<std::size_t>(code)] = static_cast<std::int8_t>(group); }

  /// Codes that can have a group: G0 to G999.9, M0 to M999.
  static constexpr bool in_range(GCode code) { return tenths(code) >= 0 && tenths(code) < kGCodes; }
  static constexpr int kGCodes = 10000;  ///< counted in tenths
  static constexpr int kMCodes = 1000;

 private:
  std::array<std::int8_t, kGCodes> g_;
  std::array<std::int8_t, kMCodes> m_;
};

}  // namespace trn
