#include "interp/gcode/executor.h"

#include <fmt/format.h>

#include <cmath>

#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/settings.h"
#include "interp/gcode/text/block.h"

namespace trn {

namespace {

constexpr std::uint32_t letters(std::string_view text) {
  std::uint32_t mask = 0;
  for (const char c : text) mask |= Block::bit(c);
  return mask;
}

constexpr double kDialectVersion = 2.9;  // of the language that #<_vmajor> asks for

constexpr std::uint32_t kAlways = letters("FSTXYZABC") | Block::kPolarLetters;

// Words that each code uses beside the axes and F S T.
std::uint32_t g_letters(GCode code) {
  switch (code) {
    case 2_g:
    case 3_g:
      return letters("IJKPR");
    case 4_g:
      return letters("P");
    case 5_g:
      return letters("IJPQ");
    case 5.1_g:
      return letters("IJQ");
    case 5.2_g:
      return letters("PL");
    case 6.2_g:
      return letters("PKR");
    case 10_g:
      return letters("HLPQRIJ");
    case 33_g:
    case 33.1_g:
      return letters("K");
    case 41_g:
    case 42_g:
      return letters("D");
    case 41.1_g:
    case 42.1_g:
      return letters("DL");
    case 43_g:
    case 43.2_g:
    case 43.4_g:
      return letters("H");
    case 43.5_g:
      return letters("HIJK");
    case 53.1_g:
      return letters("P");
    case 64_g:
      return letters("PQR");
    case 68.2_g:
      return letters("IJKPQR");
    case 68.3_g:
      return letters("R");
    case 73_g:
    case 83_g:
      return letters("LQR");
    case 81_g:
    case 85_g:
      return letters("LR");
    case 74_g:
    case 84_g:
    case 82_g:
    case 86_g:
    case 88_g:
    case 89_g:
      return letters("LPR");
    case 76_g:
      return letters("PIJRKQHEL");
    case 87_g:
      return letters("LRIJK");
    case 96_g:
      return letters("D");
    case 183_g:
      return letters("HQRL");
    default:
      return 0;
  }
}

std::uint32_t m_letters(int code, bool user) {
  if (code >= 62 && code <= 65) return letters("P");
  if (code == 66) return letters("PELQ");
  if (code == 67 || code == 68) return letters("EQ");
  if (code >= 50 && code <= 53) return letters("P");
  if (code == 98) return letters("PL");
  if (code == 61) return letters("Q");
  if (code == 19) return letters("RPQ");
  return user ? letters("PQ") : 0;
}

GCode plane_code(Plane plane) { return plane == Plane::kXY ? 17_g : plane == Plane::kXZ ? 18_g : 19_g; }

std::string_view who_uses(char letter) {
  switch (letter) {
    case 'D':
      return "G41, G42 or G96 uses D";
    case 'E':
      return "M66, M67 or M68 uses E";
    case 'H':
      return "G43, G43.2, G43.4, G43.5 or G183 uses H";
    case 'I':
    case 'J':
      return "an arc, a spline, G87 or G43.5 uses I and J";
    case 'K':
      return "an arc, G33, G87 or G43.5 uses K";
    case 'L':
      return "a canned cycle, G10, M66 or M98 uses L";
    case 'P':
      return "G4, G10, G64, an arc, a cycle or an M code uses P";
    case 'Q':
      return "G64, G73, G83, G183 or an M code uses Q";
    default:
      return "an arc, a cycle, G10, G64 or M19 uses R";
  }
}

void check_cycle_words(const Block& b, GCode motion) {
  const bool cycle = motion >= 73_g && motion <= 89_g && motion != 80_g;
  const bool thread = motion == 33_g || motion == 33.1_g;
  const bool smoothing = motion == 5.1_g && b.has('Q') && !b.has('I');  // G05.1 Q of other controls
  if ((cycle || thread || (motion == 5.1_g && !smoothing) || (motion >= 38.2_g && motion <= 38.5_g)) &&
      !b.has_axis_word())
    fail(GcodeErrorCode::kMissingWord, b.motion_column(), g_name(motion), "axis words");
  if (thread && !b.has('K'))
    fail(GcodeErrorCode::kMissingWord, b.motion_column(), g_name(motion), "a K word");
  if (thread && b['K'] <= 0)
    fail(GcodeErrorCode::kBadValue, b.at('K'), 'K', b['K'], g_name(motion),
         "the way of a turn, greater than 0");
  if (thread && b.has('F'))
    fail(GcodeErrorCode::kUnusedWord, b.at('F'), 'F', "the spindle gives the feed of G33 and G33.1");
  if (motion == 76_g)
    for (const char letter : {'Z', 'I', 'J', 'K', 'P'})
      if (!b.has(letter))
        fail(GcodeErrorCode::kMissingWord, b.motion_column(), "G76", fmt::format("a word {}", letter));
  if (!cycle || motion == 76_g) return;
  for (const char letter : {'A', 'B', 'C'})
    if (b.has(letter))
      fail(GcodeErrorCode::kCycle, b.at(letter), fmt::format("{} moves no rotary axis", g_name(motion)),
           "X Y Z");
  if (b.has('L') && (b['L'] < 0 || b['L'] != std::round(b['L'])))
    fail(GcodeErrorCode::kBadValue, b.at('L'), 'L', b['L'], g_name(motion),
         "a whole number of repeats from 1");
}

// Also of an arc that goes on without its code.
void check_turns(const Block& b) {
  if (!b.has('P')) return;
  const double turns = b['P'];
  if (turns != std::round(turns)) fail(GcodeErrorCode::kNotInteger, b.at('P'), 'P', turns);
  if (turns < 1 || turns > 1e6)
    fail(GcodeErrorCode::kBadValue, b.at('P'), 'P', turns, "an arc", "1 turn to 1000000");
}

// Words without which a code means nothing, and values no code takes: before anything of the block is done.
void check_words(const Block& b, GCode motion) {
  if (b.has('F') && b['F'] < 0)
    fail(GcodeErrorCode::kBadValue, b.at('F'), 'F', b['F'], "a feed rate", "F of 0 or more");
  if (b.has('S') && b['S'] < 0)
    fail(GcodeErrorCode::kBadValue, b.at('S'), 'S', b['S'], "a spindle speed", "S of 0 or more");
  if (motion > 3_g) check_cycle_words(b, motion);
  if (motion == 2_g || motion == 3_g) check_turns(b);
  if (!b.any_g) return;
  const GCode code = b.code(GGroup::kNonModal);
  const std::uint32_t column = b.at(GGroup::kNonModal);
  if (code == 10_g && !b.has('L')) fail(GcodeErrorCode::kMissingWord, column, "G10", "an L word");
  if (code == 10_g && !b.has('P')) fail(GcodeErrorCode::kMissingWord, column, "G10", "a P word");
  if ((code == 52_g || code == 92_g) && !b.has_axis_word())
    fail(GcodeErrorCode::kMissingWord, column, g_name(code), "axis words");
  if (code == 53_g && motion == kNoGCode)
    fail(GcodeErrorCode::kMissingWord, column, "G53", "G0 or G1 and axis words");
  if (code == 53_g && motion != 0_g && motion != 1_g)
    fail(GcodeErrorCode::kMachineMove, column,
         fmt::format("goes with G0 and G1, and not with {}", g_name(motion)));
}

}  // namespace

Executor::Executor(const ExecutorParts& parts)
    : knife_(parts.config.tangential, parts.sink),
      parts_{parts.config, parts.parameters, parts.tools, parts.kinematics, knife_, parts.warn, parts.asks},
      axis_mask_(parts.kinematics ? parts.kinematics->word_mask() : 0x3FU),
      comp_(parts.config.gouge_check != GougeCheckMode::kOff),
      warned_words_(parts.config.words.size(), false) {
  for (const MappedWord& word : parts_.config.words)
    ignores_ |= word.action == WordAction::kIgnore && (word.m_code >= 0 || word.g_code != kNoGCode);
}

void Executor::put(const CanonCommand& command) {
  if (comp_.active())
    comp_.pass(command, line_, parts_.sink);
  else
    put_now(command);
}

// Does not wait for the move that cutter compensation holds back.
void Executor::put_now(const CanonCommand& command) { parts_.sink.put(command, line_); }

void Executor::begin(const MachineWords& start) {
  line_ = 0;
  block_delete_ = parts_.config.block_delete;
  // In the order in which the machine needs to know: units before any length, offsets before the place that
  // they make of the machine's.
  s_.modal.path = parts_.config.path_mode;
  s_.modal.great_circle = parts_.config.great_circle;
  if (const int tool = spindle_tool(); tool != 0) tool_is_in(tool);
  put(canon::UseLengthUnits{false});
  load_system(static_cast<int>(parts_.parameters[parameter::kSystem]));
  s_.g92_active = parts_.parameters[parameter::kG92Active] != 0;
  if (s_.g92_active) s_.g92 = from_mm(stored(parameter::kG92));
  put(canon::SetG5xOffset{s_.modal.work_offset, s_.g5x});
  put(canon::SetG92Offset{s_.g92});
  put(canon::SetXyRotation{s_.rotation_deg});
  put(PlainCanon::kFeedReferenceXyz);
  put(PlainCanon::kOnReset);
  // Last, since it depends on all offsets above: the machine stands still and only its coordinates are the
  // program's.
  s_.position = from_mm(frame().to_program(start));
  if (parts_.config.inch) set_units(true);
}

GCode Executor::motion_of(const Block& b) const {
  const GCode code = b.code(GGroup::kMotion);
  if (only_sets_mode(b)) return kNoGCode;
  if (code != kNoGCode) return code;
  if (other_axis_code(b)) return kNoGCode;
  // The motion mode goes on without its code: "I5" in G2 is a full circle, for which no axis word is needed.
  const bool arc_only = (s_.motion == 2_g || s_.motion == 3_g) && (b.present & letters("IJK"));
  const bool vector_only = s_.tool_vector && (b.present & letters("IJK"));
  const bool knot_only = s_.motion == 6.2_g && b.has('K');
  if (b.has_axis_word() || arc_only || vector_only || knot_only) return s_.motion;
  return kNoGCode;
}

// "G0 G91 G28 Z0": the axis words are those of G28 or G30, and G0 is the mode of the lines after it.
bool Executor::only_sets_mode(const Block& b) {
  if (!b.any_g) return false;
  const GCode code = b.code(GGroup::kMotion), home = b.code(GGroup::kNonModal);
  return (home == 28_g || home == 30_g) && (code == 0_g || code == 1_g || code == 2_g || code == 3_g);
}

// Codes outside the motion group that take the axis words for themselves.
bool Executor::other_axis_code(const Block& b) const {
  switch (b.code(GGroup::kNonModal)) {
    case 10_g:
    case 28_g:
    case 30_g:
    case 52_g:
    case 92_g:
      return true;
    default:
      break;
  }
  // G43.1, G68.2 and G68.3 have their axis words as an offset and as the plane's origin, not as a place to go
  // to.
  const GCode plane = b.code(GGroup::kTiltedPlane);
  return b.code(GGroup::kToolLength) == 43.1_g || plane == 68.2_g || plane == 68.3_g ||
         (b.code(GGroup::kToolLength) == 43.2_g && !b.has('H'));
}

std::uint32_t Executor::used_letters(const Block& b, GCode motion) const {
  std::uint32_t used = kAlways;
  for (const GCode code : b.g)
    if (code != kNoGCode) used |= g_letters(code);
  for (std::size_t i = 0; i < b.m.size(); ++i)
    if (b.m[i] >= 0) used |= m_letters(b.m[i], i == static_cast<std::size_t>(MGroup::kUser));
  if (motion != kNoGCode) used |= g_letters(motion);
  if (s_.tool_vector && (motion == 0_g || motion == 1_g)) used |= letters("IJK");
  return used;
}

void Executor::check_unused(const Block& b, GCode motion) const {
  // Most blocks have axis words and F, S, T only and are done with one mask. A letter that no code of the
  // line uses is refused: it is most often a code that was forgotten, such as "P0.5" without its G4.
  const std::uint32_t unused = b.present & ~kAlways ? b.present & ~used_letters(b, motion) : 0;
  if (unused)
    for (char letter = 'A'; letter <= 'Z'; ++letter)
      if (unused & Block::bit(letter))
        fail(GcodeErrorCode::kUnusedWord, b.at(letter), letter, who_uses(letter));
  if (other_axis_code(b) && b.has(GGroup::kMotion) && b.code(GGroup::kMotion) != 80_g && !only_sets_mode(b))
    fail(GcodeErrorCode::kAxisWordsConflict, b.at(GGroup::kMotion), g_name(b.code(GGroup::kMotion)),
         "another code of the line");
  if (!b.has_axis_word()) return;
  for (int axis = 0; axis < 6; ++axis)
    if (b.has(kWordLetters[axis]) && !has_axis(axis))
      fail(GcodeErrorCode::kNoSuchAxis, b.at(kWordLetters[axis]), kWordLetters[axis]);
  if (b.has_polar() && (other_axis_code(b) || b.code(GGroup::kNonModal) == 53_g))
    fail(GcodeErrorCode::kPolar, b.at(b.has(kPolarRadius) ? kPolarRadius : kPolarAngle),
         fmt::format("goes with {}", b.has(GGroup::kNonModal) ? g_name(b.code(GGroup::kNonModal))
                                                              : "a code that is no motion"));
}

bool Executor::execute(const Block& b) {
  line_ = b.line;
  const GCode motion = motion_of(b);
  if (b.code(GGroup::kNonModal) == 53_g) check_g53(b);
  check_unused(b, motion);
  // "G80 X10" and a plain "X10" in G80 are different mistakes: the one has words that nothing uses, the other
  // lacks a motion.
  if (motion == 80_g && b.has_axis_word() && !other_axis_code(b)) {
    if (b.code(GGroup::kMotion) == 80_g) fail(GcodeErrorCode::kAxisWordsUnused, b.at(GGroup::kMotion), "G80");
    fail(GcodeErrorCode::kNoMotionMode, b.present & letters("XYZ") ? b.at(b.has('X')   ? 'X'
                                                                          : b.has('Y') ? 'Y'
                                                                                       : 'Z')
                                                                   : 1);
  }
  // What can be refused without knowing the machine is refused here, before anything of the block is done.
  check_words(b, motion);
  if (s_.knife) check_knife(b, motion);
  if (parts_.config.spindle_axis.axis >= 0) check_spindle_axis(b, motion, true);
  if (only_sets_mode(b)) check_open_curve(b, b.code(GGroup::kMotion));
  if (b.parsed->comment_kind != CommentKind::kNone) comment(b);
  if (b.any_g) {
    if (b.has(GGroup::kFeedMode)) feed_mode(b);
    if (b.has(GGroup::kSpindleMode)) spindle_mode(b);
  }
  // From here on in the order of execution of RS274/NGC (section 3.8): feed mode, F, S, T, tool
  // change, spindle, coolant, overrides, dwell, plane, units, offsets, distance mode, motion, stop.
  if (b.has('F')) feed(b);
  if (b.has('S')) speed(b);
  if (b.has('S') || (b.any_g && b.has(GGroup::kSpindleMode))) tell_spindle();
  if (b.has('T')) tool_select(b);
  tool_wait_ = ToolWait::kNone;
  if (b.any_m) {
    if (b.has(MGroup::kOutput)) output(b);
    if (b.has(MGroup::kToolChange)) tool_change(b);
    // The rest of the block comes when the tool is in the spindle (`execute_rest`): its moves are with the
    // new tool.
    if (tool_wait_ != ToolWait::kNone) return false;
  }
  return execute_rest(b);
}

bool Executor::execute_rest(const Block& b) {
  line_ = b.line;
  const GCode motion = motion_of(b);
  if (b.any_m) m_codes(b);
  if (!b.parsed->keywords.empty()) keywords(b);
  if (s_.knife) check_knife(b, motion);
  if (parts_.config.spindle_axis.axis >= 0) check_spindle_axis(b, motion, false);
  if (b.any_g) g_codes(b);
  if (motion != kNoGCode) motion_code(b, motion);
  if (only_sets_mode(b)) s_.motion = b.code(GGroup::kMotion);
  return b.any_m && b.has(MGroup::kStop) && stop(b);
}

void Executor::pass_over(const Block& b) {
  // The block was refused, and the check of a whole program goes on behind it. Without the place where the
  // block would have gone, each of the moves behind it would be judged from a wrong start, and one mistake
  // would bring forth many.
  comp_.give_up();
  const GCode motion = motion_of(b);
  if (motion != 0_g && motion != 1_g && motion != 2_g && motion != 3_g) return;
  s_.motion = motion;
  try {
    s_.position = target(b);
  } catch (const BlockError&) {  // there is no saying where it would have gone
  }
  if (s_.knife) knife_.go_on_from(s_.position);
}

void Executor::check_g53(const Block& b) const {
  const GCode distance = b.code(GGroup::kDistance);
  if (distance == 91_g || (distance == kNoGCode && s_.modal.incremental))
    fail(GcodeErrorCode::kMachineMove, b.at(GGroup::kNonModal),
         "names a place of the machine, which no word of G91 can do");
}

void Executor::g_codes(const Block& b) {
  const GCode plain = b.code(GGroup::kNonModal);
  if (plain == 4_g) dwell(b);
  if (b.has(GGroup::kPlane)) plane(b);
  // Units before all that has a length in its words: in "G20 G43.1 Z1" the 1 is an inch.
  if (b.has(GGroup::kUnits)) units(b);
  const GCode diameter = b.code(GGroup::kDiameter);
  if (diameter != kNoGCode && (diameter == 7_g) != s_.modal.diameter) set_diameter(diameter == 7_g);
  if (b.has(GGroup::kCutterComp)) cutter_comp(b);
  if (b.has(GGroup::kToolLength)) tool_length(b);
  if (b.has(GGroup::kWorkOffset)) work_offset(b);
  if (b.has(GGroup::kPath)) path_mode(b);
  if (b.has(GGroup::kDistance) || b.has(GGroup::kArcDistance)) distance(b);
  if (b.has(GGroup::kRetract)) retract(b);
  if (b.has(GGroup::kTiltedPlane)) tilted_plane(b);
  switch (plain) {
    case 10_g:
      g10(b, parts_.config.typed);
      break;
    case 28_g:
    case 28.1_g:
    case 30_g:
    case 30.1_g:
      home_position(b, plain);
      break;
    case 52_g:
      g52(b);
      break;
    case 53.1_g:
      align_tool(b);
      break;
    case 92_g:
    case 92.1_g:
    case 92.2_g:
    case 92.3_g:
      g92(b);
      break;
    default:
      break;
  }
}

void Executor::check_open_curve(const Block& b, GCode motion) const {
  if (in_nurbs_ && motion != 5.2_g && motion != 5.3_g)
    fail(GcodeErrorCode::kSpline, b.at(GGroup::kMotion), "a G5.2 block is open", "G5.3 first");
  if (in_rational_ && motion != 6.2_g)
    fail(GcodeErrorCode::kSpline, b.at(GGroup::kMotion), "a G6.2 curve is open", "its last knots first");
}

void Executor::motion_code(const Block& b, GCode motion) {
  motion_now_ = motion;
  if (s_.modal.css || (motion > 3_g && motion != 80_g)) tell_spindle();
  check_open_curve(b, motion);
  // A G5 without I and J goes on with the tangent of the G5 before it, and of no other move.
  if (motion != 5_g) spline_chained_ = false;
  if (motion == 0_g || motion == 1_g) {
    straight(b, motion);
  } else if (motion == 2_g || motion == 3_g) {
    arc(b, motion == 2_g);
  } else if (motion == 6.2_g) {
    rational_spline(b);
  } else if (motion == 80_g) {
    note("interpreter: motion mode set to none");
  } else if (motion == 183_g) {
    tilted_drilling(b);
  } else if (motion >= 73_g) {
    cycle(b, motion);
  } else if (motion >= 38.2_g) {
    probe(b, motion);
  } else if (motion >= 33_g) {
    spindle_synchronous(b, motion);
  } else {
    spline(b, motion);
  }
  if (motion == 5_g || motion == 5.1_g) return;  // splines are not modal
  s_.motion = motion == 5.3_g ? 80_g : motion;
}

// Six words from this parameter on.
MmWords Executor::stored(int parameter) const {
  TableWords words;
  for (int i = 0; i < 6; ++i) words[i] = parts_.parameters[parameter + i];
  return in_mm(words, parts_.config.parameter_unit_mm);
}

MachineWords Executor::stored_place(int parameter) const {
  const MmWords words = stored(parameter);
  return {words.xyz, words.abc_deg};
}

void Executor::store(int parameter, const MachineWords& place) {
  store(parameter, MmWords{place.xyz, place.abc_deg});
}

void Executor::store(int parameter, const MmWords& words) {
  const TableWords table = in_table_units(words, parts_.config.parameter_unit_mm);
  for (int i = 0; i < 6; ++i) parts_.parameters[parameter + i] = table[i];
}

double Executor::position(int axis) const {
  if (comp_.active()) fail(GcodeErrorCode::kCompState, 1, "reading the position");
  check_knife_read(axis);
  return s_.position[axis];
}

double Executor::predefined(int index) const {
  if (index >= 6 && index <= 31) return predefined_mode(index);
  if (index >= 32 && index <= 43) return predefined_place(index);
  switch (index) {
    case 0:
      return kDialectVersion;
    case 2:
      return line_;
    case 3:
      return tenths(s_.motion);
    case 4:
      return tenths(plane_code(s_.modal.plane));
    case 5:
      return tenths(cutter_comp_code());
    case 44:
    case 45:
      return s_.current_tool;
    case 46:
    case 47:
      return s_.selected_tool;
    case 48:
      return call_level_;
    case 49:
      return return_value_.value_or(0);
    case 50:
      return return_value_.has_value();
    case 53:
      return from_mm(parts_.parameters[parameter::kToolDiameter] * parts_.config.parameter_unit_mm);
    case 54:
      return s_.tool_offset[kZ];
    case 55:
      return s_.rtcp;
    case 56:
      return s_.tilted;
    case 60:
      return block_delete_;
    case 61:
      return parts_.config.optional_stop;
    default:
      return 0;
  }
}

// #<_x> to #<_c> in the program's coordinates, #<_abs_x> to #<_abs_c> in the machine's (G53); both in the
// program's units.
double Executor::predefined_place(int index) const {
  check_knife_read((index - 32) % 6);
  if (index <= 37) return s_.position[index - 32];
  const int axis = index - 38;
  const double place = machine_now(1)[axis];
  return axis < 3 ? from_mm(place) : place;
}

// #<_metric> to #<_rpm>, numbers 6 to 31 of the table.
double Executor::predefined_mode(int index) const {
  const ModalState& m = s_.modal;
  const double values[] = {double(!m.inch),
                           double(m.inch),
                           double(!m.incremental),
                           double(m.incremental),
                           double(m.feed_mode == FeedMode::kInverseTime),
                           double(m.feed_mode == FeedMode::kPerMinute),
                           double(m.feed_mode == FeedMode::kPerRevolution),
                           double(tenths(kWorkOffsetCodes[static_cast<std::size_t>(m.work_offset - 1)])),
                           double(!s_.tool_offset.is_zero()),
                           double(!m.retract_to_start),
                           double(m.retract_to_start),
                           double(!m.css),
                           double(m.css),
                           double(m.arc_absolute),
                           double(m.diameter),
                           double(!m.diameter),
                           double(m.turn != SpindleTurn::kStopped),
                           double(m.turn == SpindleTurn::kClockwise),
                           double(m.mist),
                           double(m.flood),
                           double(m.speed_override),
                           double(m.feed_override),
                           double(m.adaptive_feed),
                           double(m.feed_hold),
                           m.feed,
                           m.speed};
  return values[index - 6];
}

}  // namespace trn
