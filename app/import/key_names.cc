#include "app/import/key_names.h"

#include <fmt/format.h>

#include <algorithm>

#include "core/letter_case.h"

namespace trn {

namespace {

struct KeyName {
  std::string_view section;  ///< with * at its end: whatever follows
  std::string_view key;
};

// What LinuxCNC itself reads and a machine depends on.
constexpr KeyName kKeyNames[] = {
    {"JOINT_*", "TYPE"},
    {"JOINT_*", "MIN_LIMIT"},
    {"JOINT_*", "MAX_LIMIT"},
    {"JOINT_*", "MAX_VELOCITY"},
    {"JOINT_*", "MAX_ACCELERATION"},
    {"JOINT_*", "MAX_JERK"},
    {"JOINT_*", "BACKLASH"},
    {"JOINT_*", "COMP_FILE"},
    {"JOINT_*", "FERROR"},
    {"JOINT_*", "MIN_FERROR"},
    {"JOINT_*", "HOME"},
    {"JOINT_*", "HOME_OFFSET"},
    {"JOINT_*", "HOME_SEARCH_VEL"},
    {"JOINT_*", "HOME_LATCH_VEL"},
    {"JOINT_*", "HOME_FINAL_VEL"},
    {"JOINT_*", "HOME_SEQUENCE"},
    {"JOINT_*", "HOME_USE_INDEX"},
    {"JOINT_*", "HOME_IGNORE_LIMITS"},
    {"JOINT_*", "HOME_IS_SHARED"},
    {"JOINT_*", "HOME_ABSOLUTE_ENCODER"},
    {"JOINT_*", "VOLATILE_HOME"},
    {"JOINT_*", "LOCKING_INDEXER"},
    {"JOINT_*", "ENCODER_SCALE"},
    {"JOINT_*", "INPUT_SCALE"},
    {"JOINT_*", "STEP_SCALE"},
    {"JOINT_*", "OUTPUT_SCALE"},
    {"JOINT_*", "SCALE"},
    {"AXIS_*", "MIN_LIMIT"},
    {"AXIS_*", "MAX_LIMIT"},
    {"AXIS_*", "MAX_VELOCITY"},
    {"AXIS_*", "MAX_ACCELERATION"},
    {"AXIS_*", "WRAPPED_ROTARY"},
    {"TRAJ", "LINEAR_UNITS"},
    {"TRAJ", "ANGULAR_UNITS"},
    {"TRAJ", "COORDINATES"},
    {"TRAJ", "HOME"},
    {"TRAJ", "MAX_LINEAR_VELOCITY"},
    {"TRAJ", "MAX_LINEAR_ACCELERATION"},
    {"KINS", "KINEMATICS"},
    {"KINS", "JOINTS"},
    {"EMC", "MACHINE"},
    {"EMCMOT", "SERVO_PERIOD"},
    {"EMCIO", "TOOL_TABLE"},
    {"HAL", "HALFILE"},
    {"HAL", "HALCMD"},
    {"RS274NGC", "PARAMETER_FILE"},
    {"RS274NGC", "RS274NGC_STARTUP_CODE"},
    {"RS274NGC", "CENTER_ARC_RADIUS_TOLERANCE_MM"},
    {"RS274NGC", "CENTER_ARC_RADIUS_TOLERANCE_INCH"},
    {"RS274NGC", "SUBROUTINE_PATH"},
    {"RS274NGC", "USER_M_PATH"},
    {"RS274NGC", "REMAP"},
    {"DISPLAY", "PROGRAM_PREFIX"},
    {"DISPLAY", "LATHE"},
    {"SPINDLE_*", "MAX_FORWARD_VELOCITY"},
    {"SPINDLE_*", "MIN_FORWARD_VELOCITY"},
    {"SPINDLE_*", "MAX_REVERSE_VELOCITY"},
    {"SPINDLE_*", "MIN_REVERSE_VELOCITY"},
};

bool is_section(std::string_view pattern, std::string_view section) {
  if (!pattern.ends_with('*')) return pattern == section;
  return section.starts_with(pattern.substr(0, pattern.size() - 1));
}

}  // namespace

std::string key_in_capitals(std::string_view section, std::string_view key) {
  const std::string big_section = upper_case(section), big_key = upper_case(key);
  if (big_section == section && big_key == key) return "";
  const bool known = std::any_of(std::begin(kKeyNames), std::end(kKeyNames), [&](const KeyName& name) {
    return is_section(name.section, big_section) && name.key == big_key;
  });
  return known ? fmt::format("[{}]{}", big_section, big_key) : "";
}

}  // namespace trn
