#include <fmt/format.h>

#include "core/axes.h"
#include "core/frames.h"
#include "core/ports.h"
#include "core/units.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/settings.h"
#include "interp/gcode/text/block.h"

// TANGON and TANGOF: the knife follows the path (TangentialKnife). While it does the program's frame, tool
// and plane stay as they are, so that a direction in XY has one meaning.
namespace trn {

namespace {

// What may stand beside the moves of a knife; G0 to G3 and G80 among the motions.
constexpr GGroup kKnifeGroups[] = {GGroup::kMotion,   GGroup::kDistance, GGroup::kArcDistance,
                                   GGroup::kFeedMode, GGroup::kPath,     GGroup::kIgnored};

bool is_knife_motion(GCode motion) {
  return motion == kNoGCode || motion == 0_g || motion == 1_g || motion == 2_g || motion == 3_g ||
         motion == 80_g;
}

bool is_knife_code(GGroup group, GCode code) {
  if (code == 40_g || code == 4_g || code == 94_g || code == 17_g) return true;
  for (const GGroup allowed : kKnifeGroups)
    if (group == allowed) return code != 93_g;
  return false;
}

}  // namespace

void Executor::check_knife(const Block& b, GCode motion) const {
  const char letter = kWordLetters[parts_.config.tangential.axis];
  if (b.has(letter))
    fail(GcodeErrorCode::kKnife, b.at(letter), fmt::format("a word {}", letter), ": it turns by itself");
  if (!is_knife_motion(motion)) fail(GcodeErrorCode::kKnife, b.motion_column(), g_name(motion), "");
  for (std::size_t i = 0; b.any_g && i < kGGroupCount; ++i) {
    const auto group = static_cast<GGroup>(i);
    if (b.has(group) && !is_knife_code(group, b.code(group)))
      fail(GcodeErrorCode::kKnife, b.at(group), g_name(b.code(group)), "");
  }
  for (const MGroup group : {MGroup::kToolChange, MGroup::kState})
    if (b.any_m && b.has(group))
      fail(GcodeErrorCode::kKnife, b.at(group), fmt::format("M{}", b.code(group)), "");
}

// A direction in XY is the word itself only where the axis turns the knife about Z, counterclockwise from
// above.
void Executor::check_knife_axis(std::uint32_t column, std::string_view word) const {
  constexpr double kSome_rad = 0.5, kSameTurn = 1e-9;
  const int axis = parts_.config.tangential.axis;
  bool turns = parts_.kinematics && has_axis(axis);
  if (turns) {
    Vec3 abc = orientation_abc_rad(s_.position);
    abc[axis - kA] = kSome_rad;
    turns = (parts_.kinematics->orientation(abc) - rot_z(kSome_rad)).norm() < kSameTurn;
  }
  if (!turns)
    fail(GcodeErrorCode::kKnifeStart, column, word,
         fmt::format("no axis {} turns the tool about Z, counterclockwise from above as its word grows",
                     kWordLetters[axis]));
}

void Executor::check_knife_read(int axis) const {
  if (s_.knife && axis == parts_.config.tangential.axis)
    fail(GcodeErrorCode::kKnife, 1, fmt::format("reading the place of {}", kWordLetters[axis]), "");
}

// An edge that trails behind the axis is a tool with an offset in X, which turns with the knife: RTCP keeps
// the edge on the path.
void Executor::switch_knife(bool on, std::uint32_t column, std::string_view word) {
  const int axis = parts_.config.tangential.axis;
  if (on == s_.knife) return;
  if (!on) {
    s_.position[axis] = knife_.stop();
    s_.knife = false;
    if (knife_rtcp_) set_rtcp(false, s_.tool_offset, column, word);
    knife_rtcp_ = false;
    return;
  }
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, word);
  if (axis == parts_.config.spindle_axis.axis && !s_.spindle_is_axis)
    fail(GcodeErrorCode::kKnifeStart, column, word,
         fmt::format("{} is a spindle now; {} makes an axis of it", kWordLetters[axis],
                     spindle_axis_word(WordAction::kSpindleIsAxis)));
  if (s_.tilted) fail(GcodeErrorCode::kTiltedPlane, column, word, "G69 first");
  if (s_.modal.plane != Plane::kXY) fail(GcodeErrorCode::kPlane, column, word, "G18 or G19", "G17");
  if (s_.modal.feed_mode == FeedMode::kInverseTime)
    fail(GcodeErrorCode::kKnifeStart, column, word,
         "G94 or G95 first; in G93 the time of a turn on the spot is not told");
  check_knife_axis(column, word);
  knife_rtcp_ = !s_.rtcp && !s_.tool_offset.xyz.head<2>().isZero(0);
  if (knife_rtcp_) set_rtcp(true, s_.tool_offset, column, word);
  s_.knife = true;
  knife_.start(s_.position, s_.rotation_deg - (s_.g5x + s_.g92)[axis], s_.modal.inch);
}

}  // namespace trn
