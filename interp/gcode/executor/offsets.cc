#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "core/frames.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/measured_values.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/settings.h"
#include "interp/gcode/text/block.h"
#include "interp/gcode/tool_table.h"
#include "interp/gcode/work_frame.h"

namespace trn {

namespace {

// Turned about Z.
template <typename DegreesAndMm>
DegreesAndMm turned(const DegreesAndMm& v, double deg) {
  DegreesAndMm out = v;
  if (deg != 0) out.xyz = rot_z(rad_from_deg(deg)) * v.xyz;
  return out;
}

int system_base(int index) { return parameter::kFirstOffset + (index - 1) * parameter::kOffsetStride; }

}  // namespace

/// In mm and degrees.
WorkFrame Executor::frame() const {
  WorkFrame frame;
  frame.g5x = to_mm(s_.g5x);
  frame.g92 = to_mm(s_.g92);
  frame.rotation_deg = s_.rotation_deg;
  frame.tilted = s_.tilted;
  frame.origin = s_.modal.inch ? Vec3(s_.tilt_origin * kMmPerInch) : s_.tilt_origin;
  frame.R_tilt = s_.R_tilt;
  return frame;
}

ProgramWords Executor::in_words(ProgramWords tool_offset) const {
  if (parts_.kinematics) tool_offset.xyz = parts_.kinematics->tool_in_words(tool_offset.xyz);
  return tool_offset;
}

bool Executor::head_is_tilted() const {
  return parts_.kinematics && !parts_.kinematics->orientation(Vec3::Zero()).isIdentity(0);
}

void Executor::load_system(int index) {
  const int base = system_base(index);
  s_.g5x = from_mm(stored(base));
  s_.rotation_deg = parts_.parameters[base + parameter::kOffsetRotation];
  s_.modal.work_offset = index;
  parts_.parameters[parameter::kSystem] = index;
}

void Executor::put_system(bool with_g92) {
  put(canon::SetG5xOffset{s_.modal.work_offset, s_.g5x});
  if (with_g92) put(canon::SetG92Offset{s_.g92});
  put(canon::SetXyRotation{s_.rotation_deg});
}

void Executor::work_offset(const Block& b) {
  const GCode code = b.code(GGroup::kWorkOffset);
  const auto found = std::find(kWorkOffsetCodes.begin(), kWorkOffsetCodes.end(), code);
  const int index = static_cast<int>(found - kWorkOffsetCodes.begin()) + 1;
  if (comp_.active()) fail(GcodeErrorCode::kCompState, b.at(GGroup::kWorkOffset), "a change of work offset");
  if (index == s_.modal.work_offset) return note("interpreter: continuing to use same coordinate system");
  if (s_.tilted)
    fail(GcodeErrorCode::kTiltedPlane, b.at(GGroup::kWorkOffset), "a change of work offset in a tilted plane",
         "G69 first");
  keep_machine([&] { load_system(index); });
  put_system(true);
}

ProgramWords Executor::table_offset(int number, std::uint32_t column) const {
  if (number == 0) return {};
  const Tool* tool = parts_.tools.find(number);
  if (!tool) unknown_tool(number, column);
  return from_mm(tool->offset);
}

void Executor::tool_length(const Block& b) {
  const GCode code = b.code(GGroup::kToolLength);
  const std::uint32_t column = b.at(GGroup::kToolLength);
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, g_name(code));
  int number = s_.current_tool;
  if (b.has('H')) {
    if (b['H'] != std::round(b['H']) || b['H'] < 0) fail(GcodeErrorCode::kNotInteger, b.at('H'), 'H', b['H']);
    if (b['H'] != 0) number = static_cast<int>(b['H']);
  }
  ProgramWords offset = s_.tool_offset;
  switch (code) {
    case 49_g:
      offset = {};
      break;
    case 43.1_g:
    case 43.2_g:
      if (code == 43.2_g && b.has('H')) {
        offset += table_offset(number, b.at('H'));
        break;
      }
      if (!b.has_axis_word()) fail(GcodeErrorCode::kMissingWord, column, g_name(code), "axis words");
      for (int i = 0; i < 6; ++i)
        if (b.has(kWordLetters[i])) offset[i] = (code == 43.2_g ? offset[i] : 0) + b[kWordLetters[i]];
      break;
    default:
      offset = table_offset(number, b.has('H') ? b.at('H') : column);
  }
  if (code == 43.4_g || code == 43.5_g) {
    set_rtcp(true, offset, column, g_name(code));
    s_.tool_vector = code == 43.5_g;
    return;
  }
  s_.tool_vector = false;
  set_tool_offset(offset, code);
}

void Executor::set_tool_offset(const ProgramWords& offset, GCode code) {
  s_.tool_length_code = code;
  // Where the words are the tip in the table, another tool length means another tip under the same spindle,
  // and the kinematics has to find it.
  if (tip_in_table() || (s_.rtcp && code == 49_g))
    return set_rtcp(s_.rtcp && code != 49_g, offset, 1, g_name(code));
  if (s_.tilted) {
    WorkFrame f = frame();
    const MachineWords machine =
        f.to_machine(to_mm(s_.position)) + to_mm(in_words(s_.tool_offset)) - to_mm(in_words(offset));
    s_.position = from_mm(f.to_program(machine));
  } else if (s_.rotation_deg != 0) {
    // The offset lies along the machine's axes, the position in those turned by G10 L2 R: the difference is
    // turned back into them.
    const ProgramWords shift = in_words(s_.tool_offset - offset);
    s_.position.xyz += rot_z(rad_from_deg(-s_.rotation_deg)) * shift.xyz;
    s_.position.abc_deg += shift.abc_deg;
  } else {
    s_.position += in_words(s_.tool_offset - offset);
  }
  s_.tool_offset = offset;
  put(canon::UseToolLengthOffset{offset});
}

void Executor::g10(const Block& b, bool by_hand) {
  if (b['P'] != std::round(b['P']) || b['P'] < 0) fail(GcodeErrorCode::kNotInteger, b.at('P'), 'P', b['P']);
  const double l = b['L'];
  if (b.has('H') && l != 1)
    fail(GcodeErrorCode::kUnusedWord, b.at('H'), 'H', "G10 L1 gives a tool its pocket");
  if (l == 1 || l == 10 || l == 11) return g10_tool(b, static_cast<int>(l), by_hand);
  if (l == 2 || l == 20) return g10_system(b, static_cast<int>(l));
  fail(GcodeErrorCode::kBadValue, b.at('L'), 'L', l, "G10", "L1, L2, L10, L11 or L20");
}

// A program that names a tool which is not there is wrong; an operator adds it. What tells the tool to people
// is the comment of the operator's line, as in the table's file.
Tool& Executor::table_entry(const Block& b, bool by_hand) {
  const int number = static_cast<int>(b['P']);
  const std::map<int, Tool>& tools = parts_.tools.tools();
  const bool adds = !tools.empty() && !parts_.tools.find(number);
  if (adds && !(by_hand && b['L'] == 1)) unknown_tool(number, b.at('P'));
  const auto taken = [&](int pocket) {
    return std::any_of(tools.begin(), tools.end(), [&](const auto& entry) {
      return entry.first != number && entry.second.pocket == pocket;
    });
  };
  int pocket = number;
  if (b.has('H')) {
    if (b['H'] != std::round(b['H']) || std::abs(b['H']) > 99999999)
      fail(GcodeErrorCode::kNotInteger, b.at('H'), 'H', b['H']);
    pocket = static_cast<int>(b['H']);
    if (pocket < 0 || (pocket != 0 && taken(pocket)))
      fail(GcodeErrorCode::kBadValue, b.at('H'), 'H', pocket, "G10 L1",
           "a pocket that no other tool has, or 0");
  } else if (adds && taken(pocket)) {
    for (pocket = 1; taken(pocket);) ++pocket;
  }
  Tool& tool = parts_.tools.at_or_new(number);
  if (b.has('H') || adds) tool.pocket = pocket;
  if (by_hand && b['L'] == 1 && b.parsed && b.parsed->comment_kind == CommentKind::kPlain)
    tool.comment = b.parsed->comment;
  return tool;
}

// L1 sets the entry; L10 so that the present place becomes the words in the work offset, L11 in G59.3. Words
// are in the turned axes of the system, the entry in those of the machine.
void Executor::g10_tool(const Block& b, int l, bool by_hand) {
  const int number = static_cast<int>(b['P']);
  if (number == 0) fail(GcodeErrorCode::kBadValue, b.at('P'), 'P', 0, "G10 L1", "a tool number");
  if (b.has('Q') && (b['Q'] != std::round(b['Q']) || b['Q'] < 0 || b['Q'] > 9))
    fail(GcodeErrorCode::kBadValue, b.at('Q'), 'Q', b['Q'], "G10 L1", "an orientation from 0 to 9");
  if (l != 1 && head_is_tilted())
    fail(GcodeErrorCode::kNotSupported, b.at('L'), fmt::format("G10 L{}", l),
         "the head is tilted, so that one coordinate does not tell a length: measure it along the tool and "
         "write it with G10 L1");
  if (!b.has_axis_word() && (l != 1 || !(b.has('R') || b.has('I') || b.has('J') || b.has('Q') || b.has('H'))))
    fail(GcodeErrorCode::kMissingWord, b.at(GGroup::kNonModal), fmt::format("G10 L{}", l), "axis words");
  Tool& tool = table_entry(b, by_hand);
  double turn_deg = 0;
  MmWords here;  // where a tool of no length would stand, mm
  if (l == 10) {
    turn_deg = s_.rotation_deg;
    here = to_mm(s_.position) + turned(to_mm(s_.tool_offset), -turn_deg);
  } else if (l == 11) {
    WorkFrame fixture;
    const int base = system_base(9);
    fixture.g5x = stored(base);
    turn_deg = fixture.rotation_deg = parts_.parameters[base + parameter::kOffsetRotation];
    here = fixture.to_program(frame().to_machine(to_mm(s_.position)) + to_mm(s_.tool_offset));
  }
  MmWords offset = turned(tool.offset, -turn_deg);
  for (int i = 0; i < 6; ++i) {
    const char letter = kWordLetters[i];
    if (!b.has(letter)) continue;
    const double word = i < 3 ? to_mm(b[letter]) : b[letter];
    offset[i] = l == 1 ? word : here[i] - word;
  }
  tool.offset = turned(offset, turn_deg);
  if (b.has('R')) tool.diameter = 2 * to_mm(b['R']);
  if (b.has('I')) tool.front_deg = b['I'];
  if (b.has('J')) tool.back_deg = b['J'];
  if (b.has('Q')) tool.orientation = static_cast<int>(b['Q']);
  if (number == s_.current_tool)
    set_spindle_tool(parts_.parameters, parts_.tools, number, parts_.config.parameter_unit_mm);
  canon::SetToolTableEntry entry{
      tool.slot,       number,         in_table_units(tool.offset, parts_.config.parameter_unit_mm),
      tool.diameter,   tool.front_deg, tool.back_deg,
      tool.orientation};
  put(entry);
  if (tool.slot != spindle_slot_) return;
  entry.pocket = 0;  // the spindle
  put(entry);
}

void Executor::g10_system(const Block& b, int l) {
  if (b['P'] > 9)
    fail(GcodeErrorCode::kBadValue, b.at('P'), 'P', b['P'], "G10 L2", "P0 (the active system) to P9");
  const int index = b['P'] == 0 ? s_.modal.work_offset : static_cast<int>(b['P']);
  const int base = system_base(index);
  Parameters& parameters = parts_.parameters;
  if (l == 20 && b.has('R')) fail(GcodeErrorCode::kUnusedWord, b.at('R'), 'R', "G10 L2 turns a system");
  if (s_.tilted && index == s_.modal.work_offset)
    fail(GcodeErrorCode::kTiltedPlane, b.at(GGroup::kNonModal), "G10 of the active system in a tilted plane",
         "G69 first");
  if (comp_.active() && index == s_.modal.work_offset)
    fail(GcodeErrorCode::kCompState, b.at(GGroup::kNonModal), "G10 of the active system");
  const double rotation = b.has('R') ? b['R'] : parameters[base + parameter::kOffsetRotation];
  const MachineWords machine = frame().to_machine(to_mm(s_.position));
  // L20 works in the turned axes of the system, so that each word stands for itself.
  const MmWords old_offset = stored(base);
  MachineWords here = machine;
  MmWords offset = old_offset;
  if (l == 20) {
    here = turned(machine, -rotation);
    offset = turned(old_offset, -rotation);
  }
  const MmWords g92_mm = to_mm(s_.g92);
  for (int i = 0; i < 6; ++i) {
    const char letter = kWordLetters[i];
    if (!b.has(letter)) continue;
    const double word = i < 3 ? to_mm(b[letter]) : b[letter];
    // L2 gives the offset itself, L20 the coordinate that the present place shall have. G92 lies on top of
    // the system and is taken off.
    offset[i] = l == 2 ? word : here[i] - word - g92_mm[i];
  }
  if (l == 20) offset = turned(offset, rotation);
  store(base, offset);
  parameters[base + parameter::kOffsetRotation] = rotation;
  // Only the active system changes coordinates now; any other waits for its G54 to G59.3.
  if (index != s_.modal.work_offset) return note("interpreter: setting coordinate system origin");
  keep_machine([&] { load_system(index); });
  put_system(false);
}

bool Executor::length_is_of_spindle_tool() const {
  if (!s_.rtcp && s_.tool_length_code != 43_g) return false;
  const Tool* tool = parts_.tools.find(s_.current_tool);
  return s_.tool_offset == (tool ? from_mm(tool->offset) : ProgramWords{});
}

void Executor::obey_held(const Block& b, const ProgramWords& stands) {
  const bool sets = b.has(GGroup::kNonModal) && b.code(GGroup::kNonModal) == 10_g;
  const bool puts_in = b.has(MGroup::kToolChange) && b.code(MGroup::kToolChange) == 61;
  if (sets == puts_in)
    fail(GcodeErrorCode::kNotSupported, 1, "this line",
         "while a program waits, G10 and M61 set offsets, lengths and the tool in the spindle");
  if (sets && !(b.has('L') && b.has('P')))
    fail(GcodeErrorCode::kMissingWord, b.at(GGroup::kNonModal), "G10", "L and P");
  if (comp_.active())
    fail(GcodeErrorCode::kCompState, 1, "a change of offsets or tools while the program waits");
  if (sets && (b['L'] == 10 || b['L'] == 11) && tip_in_table())
    fail(GcodeErrorCode::kNotSupported, b.at('L'), "G10 L10 with tool-centre-point control on",
         "give the tool's length itself, as 'trunnion tool NUMBER Z LENGTH' does");
  const bool follows = length_is_of_spindle_tool();
  const MachineWords stop = frame().to_machine(to_mm(s_.position));
  s_.position = stands;
  if (sets) g10(b, true);
  s_.position = from_mm(frame().to_program(stop));
  if (puts_in) tool_change(b);
  if (follows) take_spindle_length();
}

void Executor::take_spindle_length() {
  const ProgramWords offset = table_offset(s_.current_tool, 1);
  if (s_.rtcp)
    set_rtcp(true, offset, 1, "G43.4");
  else
    set_tool_offset(offset, s_.tool_length_code);
}

void Executor::set_measured(const MeasuredValues& measured) {
  const bool follows = length_is_of_spindle_tool();
  for (const auto& [number, row] : measured.tools)
    if (row.tool) parts_.tools.at_or_new(number) = *row.tool;
  for (const auto& [number, set] : measured.numbers)
    if (number != parameter::kTool) parts_.parameters[number] = set.value;
  const auto tool = measured.numbers.find(parameter::kTool);
  if (tool != measured.numbers.end()) s_.current_tool = static_cast<int>(tool->second.value);
  if (s_.current_tool != 0) spindle_slot_ = slot_of(s_.current_tool);
  set_spindle_tool(parts_.parameters, parts_.tools, s_.current_tool, parts_.config.parameter_unit_mm);
  const int base = system_base(s_.modal.work_offset);
  const auto of_system = measured.numbers.lower_bound(base);
  if (of_system != measured.numbers.end() && of_system->first < base + parameter::kOffsetStride) {
    keep_machine([this] { load_system(s_.modal.work_offset); });
    put_system(false);
  }
  if (follows) take_spindle_length();
}

void Executor::put_back(const Settings& kept) {
  const bool rtcp = s_.rtcp || kept.rtcp;
  s_ = kept;
  put_system(true);
  put(canon::UseToolLengthOffset{s_.tool_offset});
  if (rtcp) put(canon::SetRtcp{s_.rtcp, s_.position});
}

void Executor::g92(const Block& b) {
  const GCode code = b.code(GGroup::kNonModal);
  const std::uint32_t column = b.at(GGroup::kNonModal);
  if (comp_.active() && !(code != 92_g && s_.g92.is_zero()))
    fail(GcodeErrorCode::kCompState, column, g_name(code));
  if (s_.tilted) fail(GcodeErrorCode::kTiltedPlane, column, g_name(code) + " in a tilted plane", "G69 first");
  if (code == 92_g) {
    for (int i = 0; i < 6; ++i) {
      if (!b.has(kWordLetters[i])) continue;
      // The machine does not move: the offset takes up what the place is called anew.
      s_.g92[i] += s_.position[i] - b[kWordLetters[i]];
      s_.position[i] = b[kWordLetters[i]];
    }
  } else {
    const ProgramWords wanted = code == 92.3_g ? from_mm(stored(parameter::kG92)) : ProgramWords{};
    s_.position += s_.g92 - wanted;
    s_.g92 = wanted;
  }
  set_g92_active(code == 92_g || code == 92.3_g);
  // G92.1 forgets the offset for good. G92.2 keeps its numbers in the parameters, from where G92.3 takes them
  // back.
  if (code != 92.2_g) store(parameter::kG92, to_mm(s_.g92));
  put(canon::SetG92Offset{s_.g92});
}

void Executor::set_g92_active(bool active) {
  s_.g92_active = active;
  parts_.parameters[parameter::kG92Active] = active ? 1 : 0;
}

// As G92.3 or G92.2: M70 to M73 keep whether the offset acts, not what it is.
void Executor::restore_g92(bool active) {
  if (active == s_.g92_active) return;
  const ProgramWords wanted = active ? from_mm(stored(parameter::kG92)) : ProgramWords{};
  s_.position += s_.g92 - wanted;
  s_.g92 = wanted;
  set_g92_active(active);
  put(canon::SetG92Offset{s_.g92});
}

void Executor::g52(const Block& b) {
  const std::uint32_t column = b.at(GGroup::kNonModal);
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, "G52");
  if (s_.tilted) fail(GcodeErrorCode::kTiltedPlane, column, "G52 in a tilted plane", "G69 first");
  for (int i = 0; i < 6; ++i) {
    if (!b.has(kWordLetters[i])) continue;
    // G52 gives the shift itself. It lies in the same place as G92's, so that one replaces the other.
    s_.position[i] += s_.g92[i] - b[kWordLetters[i]];
    s_.g92[i] = b[kWordLetters[i]];
  }
  store(parameter::kG92, to_mm(s_.g92));
  set_g92_active(true);
  put(canon::SetG92Offset{s_.g92});
}

// G28 and G30 by way of the words' point; G28.1 and G30.1 keep the present place.
void Executor::home_position(const Block& b, GCode code) {
  const int base = code < 30_g ? parameter::kG28 : parameter::kG30;
  const std::uint32_t column = b.at(GGroup::kNonModal);
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, g_name(code));
  if (code == 28.1_g || code == 30.1_g) return store(base, machine_now(column));
  if (s_.tilted) fail(GcodeErrorCode::kTiltedPlane, column, g_name(code) + " in a tilted plane", "G69 first");
  const ProgramWords by_way = target(b);
  put(canon::StraightTraverse{by_way});
  s_.position = by_way;
  suspend_rtcp(b, [&] {
    // With axis words only those axes go to the reference place: "G91 G28 Z0" draws the spindle up and leaves
    // X and Y where they are.
    ProgramWords to = from_mm(frame().to_program(stored_place(base) - to_mm(in_words(s_.tool_offset))));
    if (b.has_axis_word())
      for (int i = 0; i < 6; ++i)
        if (!b.has(kWordLetters[i])) to[i] = s_.position[i];
    put(canon::StraightTraverse{to});
    s_.position = to;
  });
}

}  // namespace trn
