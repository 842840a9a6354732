#pragma once

#include <algorithm>
#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "app/import/import_place.h"
#include "core/frames.h"

namespace trn {

/// Where in the config a note stands.
enum class ImportSpot : std::uint8_t {
  kMachine,
  kJoint,
  kKinematics,
  kProgram,
  kToolChange,
  kDrives,
  kIo,
  kEnd
};

/// Something that was not carried over, was chosen, or means something else here.
struct ImportNote {
  ImportSpot spot = ImportSpot::kEnd;
  ImportPlace place = {};
  std::string what = {}, why = {}, to_do = {};
  std::string joint = {};  ///< with kJoint: its name
};

/// A motor of the machine; lengths mm, angles degrees, by the second.
struct ImportedJoint {
  std::string name = {};
  int number = 0;  ///< of its section [JOINT_N]
  bool rotary = false;
  double min = 0, max = 0, velocity = 0, acceleration = 0, jerk = 0;
  bool searches = false;  ///< homing looks for a switch
  double home = 0;        ///< HOME: where it stands after homing; it may lie beyond the range
  double switch_at = 0;   ///< HOME_OFFSET: where the switch, or the index behind it, is; so may this
  double search_speed = 0, latch_speed = 0;
  double backlash = 0;
  double following_error = 0;
  std::optional<double> counts;  ///< encoder counts or steps of a mm or degree, with sign
  std::optional<int> sequence;   ///< HOME_SEQUENCE
};

/// An axis of a chain from the base outwards; without joint an offset alone.
struct ImportedAxis {
  std::string joint = {};
  Vec3 direction = Vec3::Zero();
  Vec3 offset_mm = Vec3::Zero();
};

struct ImportedHexapod {
  Vec3 spindle_mm = Vec3::Zero(), home_mm = Vec3::Zero();
  std::array<Vec3, 6> base_mm = {}, platform_mm = {};
  std::array<double, 6> home_legs_mm = {};
};

/// An M code that calls a sub-program.
struct ImportedCode {
  std::string code = {}, call = {};
};

enum class ImportedToolChange : std::uint8_t { kOperator, kNobody };

/// A machine of LinuxCNC as Trunnion describes it. Lengths mm, angles degrees.
struct ImportedMachine {
  std::string name = {}, source = {}, kinematics = {};
  double period_s = 0.001;
  double mm_per_unit = 1, deg_per_unit = 1;
  std::vector<ImportedJoint> joints = {};
  std::vector<ImportedAxis> tool_branch = {}, work_branch = {};
  std::optional<ImportedHexapod> hexapod = {};
  std::vector<std::string> sub_path = {}, rtcp_on = {}, rtcp_off = {}, wrapped = {};
  std::vector<ImportedCode> codes = {};
  std::optional<double> tolerance_mm = {}, arc_tolerance_mm = {};
  std::string path_mode = {};
  bool programs_in_inch = false;
  ImportedToolChange tool_change = ImportedToolChange::kOperator;
  bool io = false, spindle_encoder = false;
  double spindle_rpm_max = 0;  ///< 0: none
  std::vector<ImportNote> notes = {};

  /// What the correction of backlash keeps free at either end of a joint's range: it moves by half of the
  /// largest gap.
  double backlash_strip(bool rotary) const {
    double most = 0;
    for (const ImportedJoint& joint : joints)
      if (joint.rotary == rotary) most = std::max(most, joint.backlash);
    return most / 2;
  }

  void note(ImportSpot spot, const ImportPlace& place, std::string what, std::string why, std::string to_do,
            std::string joint = {}) {
    notes.push_back({spot, place, std::move(what), std::move(why), std::move(to_do), std::move(joint)});
  }
};

}  // namespace trn
