#pragma once

#include <array>
#include <functional>
#include <string>
#include <vector>

#include "core/frames.h"
#include "core/machine.h"
#include "core/ports.h"

namespace trn {

struct WorkspaceOptions {
  double tool_length_mm = 0;
  int points = 25;  ///< of the grid along the longest side
  std::vector<double> tilts_deg = {0, 10, 20, 30};
};

/// Why a place can or cannot be taken; the first three after kOk as KinStatus.
enum class Reach : unsigned char { kOk, kUnreachable, kSingular, kLimit, kJointRange, kNoTilt };
std::string_view to_string(Reach reach);

/// One place with one tilt: the worst over eight directions of the tilt (those that the machine has).
struct WorkspaceValue {
  Reach reach = Reach::kNoTilt;
  double conditioning =
      0;                  ///< least over greatest singular value of joints by tip and tool axis; 0: singular
  double speed_gain = 0;  ///< mm/s of the fastest linear joint per mm/s of the tip, tool direction kept
  double feed_mm_s_max = 0;   ///< speed of the tip that no joint's velocity limit forbids in any direction
  double turn_rad_s_max = 0;  ///< the same for a turn of the tool about its standing tip; 0: no turn here
};

/// What a machine reaches: a box of tip positions in the table frame B, sampled on a grid, for every tilt.
struct Workspace {
  Vec3 home_B;               ///< tip at home, upright
  Vec3 min_B;                ///< first grid point
  double step_mm = 0;        ///< of the grid, the same in x, y and z
  std::array<int, 3> count;  ///< points along x, y, z
  std::vector<double> tilts_deg;
  std::vector<WorkspaceValue> values;  ///< by tilt, z, y, x: x runs fastest

  Vec3 point(int x, int y, int z) const { return min_B + step_mm * Vec3(x, y, z); }
  std::size_t index(std::size_t tilt, int x, int y, int z) const;
};

/// Samples a machine through the same joint map that moves it, RTCP on. Joints' position ranges count, as do
/// the limits of the mechanism. `progress` is told the share done now and then. std::runtime_error if the
/// machine cannot stand upright at home, or if no joint is linear.
Workspace survey_workspace(const Machine& machine, const Kinematics& kinematics, const JointMap& map,
                           const WorkspaceOptions& options, const std::function<void(double)>& progress);

/// One line a place and tilt; header and units in its first line.
std::string workspace_csv(const Workspace& workspace);

}  // namespace trn
