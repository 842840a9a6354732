#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

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

  /// code10: the code times ten (G38.2 -> 382).
  int g_group(int code10) const {
    return code10 >= 0 && code10 < kGCodes ? g_[static_cast<std::size_t>(code10)] : -1;
  }
  int m_group(int code) const {
    return code >= 0 && code < kMCodes ? m_[static_cast<std::size_t>(code)] : -1;
  }

  /// Gives a G code (times ten) of the config a group.
  void map_g(int code10, GGroup group) {
    g_[static_cast<std::size_t>(code10)] = static_cast<std::int8_t>(group);
  }
  /// Gives an M code of the config a group (RTCP words, user codes).
  void map_m(int code, MGroup group) { m_[static_cast<std::size_t>(code)] = static_cast<std::int8_t>(group); }

  static constexpr int kGCodes = 10000;
  static constexpr int kMCodes = 1000;

 private:
  std::array<std::int8_t, kGCodes> g_;
  std::array<std::int8_t, kMCodes> m_;
};

/// "G38.2" from 382.
std::string g_name(int code10);

}  // namespace trn
