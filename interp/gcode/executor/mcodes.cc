#include <fmt/format.h>

#include <cmath>
#include <utility>

#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/settings.h"
#include "interp/gcode/text/block.h"
#include "interp/gcode/tool_table.h"

namespace trn {

namespace {

int whole_word(const Block& b, char letter, int least, int most, std::string_view what) {
  const double value = b[letter];
  if (value != std::round(value)) fail(GcodeErrorCode::kNotInteger, b.at(letter), letter, value);
  if (value < least || value > most)
    fail(GcodeErrorCode::kBadValue, b.at(letter), letter, value, what, fmt::format("{} to {}", least, most));
  return static_cast<int>(value);
}

constexpr int kMaxOutput = 63;
constexpr int kMaxTool = 99999999;

}  // namespace

void Executor::m_codes(const Block& b) {
  // RS274/NGC, section 3.8: spindle, what keeps and restores modes, coolant, overrides. M codes of the user
  // come behind them, so that they meet the machine as the line has set it.
  if (b.has(MGroup::kSpindle)) spindle(b);
  if (b.has(MGroup::kState)) modal_state(b);
  if (b.has(MGroup::kCoolant)) coolant(b);
  if (b.has(MGroup::kOverride)) overrides(b);
  if (b.has(MGroup::kUser)) user_m(b);
  if (b.has(MGroup::kRtcp)) keywords(b);
}

void Executor::tool_select(const Block& b) {
  const int tool = whole_word(b, 'T', 0, kMaxTool, "a tool number");
  check_tool(tool, b.at('T'));
  s_.selected_tool = tool;
  put_now(canon::SelectTool{tool});
}

// Without any table every number will do.
void Executor::check_tool(int number, std::uint32_t column) const {
  if (number != 0 && !parts_.tools.tools().empty() && !parts_.tools.find(number))
    unknown_tool(number, column);
}

void Executor::unknown_tool(int number, std::uint32_t column) const {
  const std::string& name = parts_.tools.name();
  if (name.empty()) fail(GcodeErrorCode::kNoToolTable, column, number);
  fail(GcodeErrorCode::kUnknownTool, column, number, name);
}

int Executor::slot_of(int number) const {
  const Tool* tool = parts_.tools.find(number);
  return tool ? tool->slot : number;
}

void Executor::tool_change(const Block& b) {
  const int code = b.code(MGroup::kToolChange);
  if (code == 6 && comp_.active())
    fail(GcodeErrorCode::kCompState, b.at(MGroup::kToolChange), "a tool change");
  if (code == 61) {
    if (!b.has('Q')) fail(GcodeErrorCode::kMissingWord, b.at(MGroup::kToolChange), "M61", "a Q word");
    const int number = whole_word(b, 'Q', 0, kMaxTool, "M61");
    check_tool(number, b.at('Q'));
    put_now(canon::ChangeToolNumber{slot_of(number)});
    tool_is_in(number);
  } else {
    put(PlainCanon::kStartChange);
    stop_spindle();
    ask_for_tool(std::max(0, s_.selected_tool));  // without a T word: no tool
  }
}

void Executor::start_spindle(SpindleTurn turn) {
  if (s_.spindle_is_axis) switch_spindle_axis(false);  // what M72 and --from bring back
  s_.modal.turn = turn;
  spindle_untold_ = false;
  put(canon::StartSpindle{turn == SpindleTurn::kClockwise});
}

void Executor::stop_spindle() {
  spindle_untold_ = false;
  s_.modal.turn = SpindleTurn::kStopped;
  put(canon::StopSpindle{});
}

// Before something that hangs on it.
void Executor::tell_spindle() {
  if (spindle_untold_) start_spindle(s_.modal.turn);
}

// The machine has it already, so that this switches nothing.
void Executor::tell_coolant() {
  if (!std::exchange(coolant_untold_, false)) return;
  if (s_.modal.mist) put(PlainCanon::kMistOn);
  if (s_.modal.flood) put(PlainCanon::kFloodOn);
}

void Executor::spindle(const Block& b) {
  switch (b.code(MGroup::kSpindle)) {
    case 3:
      return start_spindle(SpindleTurn::kClockwise);
    case 4:
      return start_spindle(SpindleTurn::kCounterclockwise);
    case 5:
      return stop_spindle();
    default:
      break;
  }
  if (!b.has('R') && !b.has('P') && !b.has('Q')) return;
  if (b.get('R', 0) < 0 || b.get('R', 0) > 360)
    fail(GcodeErrorCode::kBadValue, b.at('R'), 'R', b['R'], "M19", "an angle from 0 to 360 degrees");
  if (b.has('R') || b.has('P'))
    put(canon::OrientSpindle{b.get('R', 0), b.has('P') ? whole_word(b, 'P', 0, 2, "M19") : 0});
  if (!b.has('Q')) return;
  if (b['Q'] <= 0) fail(GcodeErrorCode::kBadValue, b.at('Q'), 'Q', b['Q'], "M19", "a time greater than 0, s");
  put(canon::WaitOrient{b['Q']});
}

void Executor::coolant(const Block& b) {
  tell_coolant();
  const int code = b.code(MGroup::kCoolant);
  if (code == 7) {
    s_.modal.mist = true;
    return put(PlainCanon::kMistOn);
  }
  if (code == 8) {
    s_.modal.flood = true;
    return put(PlainCanon::kFloodOn);
  }
  s_.modal.mist = s_.modal.flood = false;
  put(PlainCanon::kMistOff);
  put(PlainCanon::kFloodOff);
}

void Executor::overrides(const Block& b) {
  const int code = b.code(MGroup::kOverride);
  const bool on = b.get('P', 1) != 0;
  if (comp_.active()) fail(GcodeErrorCode::kCompState, b.at(MGroup::kOverride), fmt::format("M{}", code));
  ModalState& m = s_.modal;
  switch (code) {
    case 48:
    case 49:
      m.feed_override = m.speed_override = code == 48;
      put(code == 48 ? PlainCanon::kEnableFeedOverride : PlainCanon::kDisableFeedOverride);
      put(code == 48 ? PlainCanon::kEnableSpeedOverride : PlainCanon::kDisableSpeedOverride);
      break;
    case 50:
      m.feed_override = on;
      put(on ? PlainCanon::kEnableFeedOverride : PlainCanon::kDisableFeedOverride);
      break;
    case 51:
      m.speed_override = on;
      put(on ? PlainCanon::kEnableSpeedOverride : PlainCanon::kDisableSpeedOverride);
      break;
    case 52:
      m.adaptive_feed = on;
      put(on ? PlainCanon::kEnableAdaptiveFeed : PlainCanon::kDisableAdaptiveFeed);
      break;
    default:
      m.feed_hold = on;
      put(on ? PlainCanon::kEnableFeedHold : PlainCanon::kDisableFeedHold);
  }
}

void Executor::output(const Block& b) {
  const int code = b.code(MGroup::kOutput);
  const std::uint32_t column = b.at(MGroup::kOutput);
  const std::string name = fmt::format("M{}", code);
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, name);
  if (code <= 65) {
    if (!b.has('P')) fail(GcodeErrorCode::kMissingWord, column, name, "a P word");
    put(canon::SetOutputBit{code <= 63, code % 2 == 0, whole_word(b, 'P', 0, kMaxOutput, name)});
  } else if (code >= 67) {
    if (!b.has('E')) fail(GcodeErrorCode::kMissingWord, column, name, "an E word");
    put(canon::SetOutputValue{code == 67, whole_word(b, 'E', 0, kMaxOutput, name), b.get('Q', -1)});
  } else {
    if (b.has('P') == b.has('E')) fail(GcodeErrorCode::kMissingWord, column, name, "either P or E");
    // L0 takes the input as it is now; 1 to 4 wait for a rise, a fall, high or low, which an analog value has
    // not.
    const int type = b.has('L') ? whole_word(b, 'L', 0, 4, name) : 0;
    if (type != 0 && b.has('E'))
      fail(GcodeErrorCode::kBadValue, b.at('L'), 'L', type, "an analog input", "L0");
    if (type != 0 && b.get('Q', 0) <= 0)
      fail(GcodeErrorCode::kMissingWord, column, name, "a Q word greater than 0, seconds");
    const char index = b.has('P') ? 'P' : 'E';
    put(canon::WaitInput{whole_word(b, index, 0, kMaxOutput, name), b.has('E'), type, b.get('Q', 0)});
    if (parts_.asks) questions_.push_back(Question::kInput);
  }
}

void Executor::modal_state(const Block& b) {
  const auto level = static_cast<std::size_t>(call_level_);
  // Each level of calls has its own, so that a sub-program's M70 does not write over that of its caller.
  if (kept_.size() <= level) kept_.resize(level + 1);
  Kept& kept = kept_[level];
  switch (b.code(MGroup::kState)) {
    case 70:
      kept = {s_, true, false, comp_.active()};
      break;
    case 71:
      kept.valid = kept.restore_on_return = false;
      break;
    case 73:
      kept = {s_, true, true, comp_.active()};
      break;
    default:
      if (!kept.valid)
        fail(GcodeErrorCode::kMissingWord, b.at(MGroup::kState), "M72", "M70 or M73 at this level first");
      restore(kept);
  }
}

void Executor::on_return(int level) {
  if (static_cast<std::size_t>(level) >= kept_.size()) return;
  Kept& kept = kept_[static_cast<std::size_t>(level)];
  if (kept.valid && kept.restore_on_return) restore(kept);
  kept.valid = kept.restore_on_return = false;
}

// In the dialect's order of execution, and only what differs: a line of everything but M codes, with the
// first M code in it, then a line for each further M code.
void Executor::restore_modal(const Settings& state) {
  const ModalState& kept = state.modal;
  ModalState& m = s_.modal;
  restore_feed(kept);
  bool first = true;
  const auto next_m = [&](bool differs) {
    if (differs && !first) restore_geometry(state);
    first = first && !differs;
    return differs;
  };
  if (next_m(kept.turn != m.turn)) restore_spindle(kept.turn);
  if (next_m(kept.mist != m.mist || kept.flood != m.flood)) restore_coolant(kept);
  if (next_m(kept.feed_override != m.feed_override || kept.speed_override != m.speed_override))
    restore_overrides(kept);
  if (next_m(kept.adaptive_feed != m.adaptive_feed))
    put(kept.adaptive_feed ? PlainCanon::kEnableAdaptiveFeed : PlainCanon::kDisableAdaptiveFeed);
  if (next_m(kept.feed_hold != m.feed_hold))
    put(kept.feed_hold ? PlainCanon::kEnableFeedHold : PlainCanon::kDisableFeedHold);
  m.adaptive_feed = kept.adaptive_feed;
  m.feed_hold = kept.feed_hold;
  restore_geometry(state);
}

void Executor::restore_feed(const ModalState& kept) {
  ModalState& m = s_.modal;
  if (kept.inch != m.inch) set_units(kept.inch);
  // Asked before the mode is restored, since that sets the feed to 0 and the question would then have another
  // answer.
  const bool other_feed = kept.feed != m.feed;
  if (kept.feed_mode != m.feed_mode) set_feed_mode(kept.feed_mode);  // which forgets the feed
  if (kept.css != m.css || kept.css_max != m.css_max) {
    m.css = kept.css;
    m.css_max = kept.css_max;
    put(canon::SetSpindleMode{m.css_max});
  }
  if (other_feed || kept.feed != m.feed) {
    m.feed = kept.feed;
    if (m.feed_mode != FeedMode::kInverseTime) put(canon::SetFeedRate{m.feed});
  }
  if (kept.speed != m.speed) {
    m.speed = kept.speed;
    put(canon::SetSpindleSpeed{m.speed});
  }
}

void Executor::restore_spindle(SpindleTurn turn) {
  if (turn == SpindleTurn::kStopped)
    stop_spindle();
  else
    start_spindle(turn);
}

void Executor::restore_geometry(const Settings& state) {
  const ModalState& kept = state.modal;
  ModalState& m = s_.modal;
  if (kept.plane != m.plane) {
    m.plane = kept.plane;
    put(canon::SelectPlane{m.plane});
  }
  if (kept.diameter != m.diameter) set_diameter(kept.diameter);
  if (kept.work_offset != m.work_offset) {
    keep_machine([&] { load_system(kept.work_offset); });
    put_system(true);
  }
  if (kept.path != m.path || kept.path_tolerance != m.path_tolerance ||
      kept.naive_tolerance != m.naive_tolerance || kept.orientation_deg != m.orientation_deg)
    set_path(kept.path, kept.path_tolerance, kept.naive_tolerance, kept.orientation_deg);
  set_great_circle(kept.great_circle);
  if (kept.incremental != m.incremental) set_incremental(kept.incremental);
  if (kept.arc_absolute != m.arc_absolute) set_arc_absolute(kept.arc_absolute);
  if (kept.retract_to_start != m.retract_to_start) set_retract(kept.retract_to_start);
  restore_g92(state.g92_active);
}

void Executor::restore_coolant(const ModalState& kept) {
  tell_coolant();
  ModalState& m = s_.modal;
  if (!kept.mist && !kept.flood) {
    put(PlainCanon::kMistOff);
    put(PlainCanon::kFloodOff);
  } else {
    if (kept.mist != m.mist) put(kept.mist ? PlainCanon::kMistOn : PlainCanon::kMistOff);
    if (kept.flood != m.flood) put(kept.flood ? PlainCanon::kFloodOn : PlainCanon::kFloodOff);
  }
  m.mist = kept.mist;
  m.flood = kept.flood;
}

// As M48 or M49 where both are alike.
void Executor::restore_overrides(const ModalState& kept) {
  ModalState& m = s_.modal;
  const bool alike = kept.feed_override == kept.speed_override && kept.feed_override != m.feed_override;
  if (kept.feed_override != m.feed_override)
    put(kept.feed_override ? PlainCanon::kEnableFeedOverride : PlainCanon::kDisableFeedOverride);
  if (alike || kept.speed_override != m.speed_override)
    put(kept.speed_override ? PlainCanon::kEnableSpeedOverride : PlainCanon::kDisableSpeedOverride);
  m.feed_override = kept.feed_override;
  m.speed_override = kept.speed_override;
}

// Tool-centre-point control is left as it stands.
void Executor::restore_tool_length(const Settings& kept) {
  if (s_.rtcp || kept.rtcp || kept.tool_offset == s_.tool_offset) return;
  set_tool_offset(kept.tool_offset, kept.tool_length_code);
}

// M72, and the return from a sub-program with M73.
void Executor::restore(const Kept& kept) {
  if (comp_.active() && !kept.compensated) {
    flush_comp();
    note("interpreter: cutter radius compensation off");
  }
  // The directions of the knife belong to the units and the tool that are given up here.
  if (s_.knife && !kept.state.knife) switch_knife(false, 1, "M72");
  if (kept.state.modal.inch != s_.modal.inch) set_units(kept.state.modal.inch);
  tell_spindle();
  restore_tool_length(kept.state);
  restore_modal(kept.state);
}

// Spindle and coolant are in force, and the machine has them: a line that has nothing to do with them must
// not tell it again, for it may have switched them off since.
void Executor::resume(const Settings& kept) {
  Settings others = kept;
  others.modal.turn = SpindleTurn::kStopped;
  others.modal.mist = others.modal.flood = others.spindle_is_axis = false;
  take_over(others);
  const ModalState& m = kept.modal;
  s_.modal.turn = m.turn;
  s_.modal.mist = m.mist;
  s_.modal.flood = m.flood;
  s_.spindle_is_axis = kept.spindle_is_axis;
  spindle_untold_ = m.turn != SpindleTurn::kStopped;
  coolant_untold_ = m.mist || m.flood;
}

void Executor::take_over(const Settings& kept) {
  restore_switches(kept);
  restore_modal(kept);
  s_.motion = kept.motion < 73_g ? kept.motion : 80_g;  // cycles keep words of their own
  s_.selected_tool = kept.selected_tool;
  if (kept.tool_offset != s_.tool_offset || kept.tool_length_code != s_.tool_length_code)
    set_tool_offset(kept.tool_offset, kept.tool_length_code);
  if (kept.tilted) tilt(kept.tilt_origin, kept.R_tilt);
  if (kept.tilted_aligned) obey_plane(1);
  if (kept.rtcp) set_rtcp(true, kept.tool_offset, 1, "G43.4");
  s_.tool_vector = kept.tool_vector;
  if (kept.spindle_is_axis) switch_spindle_axis(true);
}

// In machine coordinates, before the tool, the frame or the tilt of the program changes anything.
void Executor::retract_to_safe_height() {
  if (!parts_.config.safe_z_mm)
    return parts_.warn(1,
                       "no [program] safe_z_mm: the way to where the program goes on leads across at the "
                       "higher of both heights, which may be inside the work");
  MachineWords machine = frame().to_machine(to_mm(s_.position));
  if (machine[kZ] >= *parts_.config.safe_z_mm) return;
  machine[kZ] = *parts_.config.safe_z_mm;
  s_.position = from_mm(frame().to_program(machine));
  put(canon::StraightTraverse{s_.position});
}

void Executor::enter(const MachineWords& start, int in_spindle, const std::optional<EntryPlace>& on_move) {
  if (comp_.active()) fail(GcodeErrorCode::kCompState, 1, "a start in the middle of a contour");
  if (s_.knife) fail(GcodeErrorCode::kKnife, 1, "a start in the middle", "");
  entered_ = s_;
  enter_at_ = on_move;
  // As a program starts, with the tool that is really in the spindle. What the skipped lines have set comes
  // back in `enter_rest`, behind the tool change.
  s_ = Settings{};
  tool_is_in(in_spindle);
  const bool deletes = block_delete_;  // may have been switched while the program ran
  begin(start);
  block_delete_ = deletes;
  retract_to_safe_height();
  tool_wait_ = ToolWait::kNone;
  if (entered_.current_tool != in_spindle) ask_for_tool(entered_.current_tool);
}

void Executor::enter_rest() {
  const Settings kept = entered_;
  take_over(kept);
  // Its line feeds from wherever the tool stands on it to its end, which counts from where it begins.
  const ProgramWords on_path = enter_at_ ? from_mm(enter_at_->at) : kept.position;
  // Up, across and down: at the higher of both heights the tool passes over the work, if safe_z_mm is above
  // it.
  ProgramWords to = s_.position;
  to[kZ] = std::max(s_.position[kZ], on_path[kZ]);
  put(canon::StraightTraverse{to});
  const double above = to[kZ];
  to = on_path;
  to[kZ] = above;
  put(canon::StraightTraverse{to});
  put(canon::StraightTraverse{on_path});
  if (enter_at_ && enter_at_->arc_share > 0) put(canon::EnterArc{kept.position, enter_at_->arc_share});
  s_ = kept;
}

void Executor::user_m(const Block& b) {
  const int code = b.code(MGroup::kUser);
  if (const SwitchCode* found = find_switch(parts_.config, code)) {
    for (const char letter : {'P', 'Q'})
      if (b.has(letter)) fail(GcodeErrorCode::kUnusedWord, b.at(letter), letter, "no switch of a correction");
    // Kept for a start in the middle, which must switch the same corrections again.
    (found->on ? s_.switched_on : s_.switched_off) |= found->corrections;
    (found->on ? s_.switched_off : s_.switched_on) &= ~found->corrections;
  }
  for (const UserCode& user : parts_.config.user_m) {
    if (user.code != code) continue;
    if (user.output >= 0) return put(canon::SetOutputBit{false, user.on, user.output});
    if (!user.call.empty()) return;  // behind the block
  }
  put(canon::UserM{code, b.get('P', 0), b.get('Q', 0)});
}

void Executor::restore_switches(const Settings& kept) {
  for (const SwitchCode& code : parts_.config.switches)
    if (code.corrections & (code.on ? kept.switched_on : kept.switched_off))
      put(canon::UserM{code.m_code, 0, 0});
}

// RTCP words, words for the way of the tool axis and ignored words of other controls, as the config maps
// them.
void Executor::keywords(const Block& b) {
  const auto act = [&](std::size_t index, std::uint32_t column) {
    const MappedWord& word = parts_.config.words[index];
    if (word.action == WordAction::kGreatCircle || word.action == WordAction::kAxisPath)
      return set_great_circle(word.action == WordAction::kGreatCircle);
    if (word.action == WordAction::kKnifeOn || word.action == WordAction::kKnifeOff)
      return switch_knife(word.action == WordAction::kKnifeOn, column, word.text);
    if (word.action == WordAction::kSpindleIsAxis || word.action == WordAction::kAxisIsSpindle) {
      if (s_.knife) fail(GcodeErrorCode::kKnife, column, word.text, "");
      return switch_spindle_axis(word.action == WordAction::kSpindleIsAxis);
    }
    if (word.action != WordAction::kIgnore && s_.knife) fail(GcodeErrorCode::kKnife, column, word.text, "");
    if (word.action != WordAction::kIgnore)
      return set_rtcp(word.action == WordAction::kRtcpOn, s_.tool_offset, column, word.text);
    if (!warned_words_[index])
      parts_.warn(column, fmt::format("{} is ignored, as the config says", word.text));
    warned_words_[index] = true;
  };
  if (b.any_m && b.has(MGroup::kRtcp)) {
    for (std::size_t i = 0; i < parts_.config.words.size(); ++i)
      if (parts_.config.words[i].m_code == b.code(MGroup::kRtcp)) act(i, b.at(MGroup::kRtcp));
    return;
  }
  for (std::size_t i = 0; i < b.parsed->keywords.size(); ++i)
    act(static_cast<std::size_t>(b.parsed->keywords[i]), b.parsed->keyword_columns[i]);
}

bool Executor::stop(const Block& b) {
  switch (b.code(MGroup::kStop)) {
    case 0:
      put(PlainCanon::kProgramStop);
      return false;
    case 1:
      put(PlainCanon::kOptionalStop);
      return false;
    case 60:
      put(PlainCanon::kPalletShuttle);
      put(PlainCanon::kProgramStop);
      return false;
    default:
      break;
  }
  finish();
  reset_at_end();
  if (b.code(MGroup::kStop) == 30) put(PlainCanon::kPalletShuttle);
  put(PlainCanon::kProgramEnd);
  return true;
}

void Executor::end_program() {
  finish();
  s_.switched_on = s_.switched_off = 0;
  put(PlainCanon::kFinish);
}

// What M2 and M30 reset (RS274/NGC section 3.6.1, with the dialect's additions).
void Executor::reset_at_end() {
  // RTCP and the plane go first: the work offset below is changed in plain machine coordinates.
  if (s_.rtcp) set_rtcp(false, s_.tool_offset, 1, "M2");
  if (s_.tilted) cancel_tilted_plane();
  if (s_.spindle_is_axis) switch_spindle_axis(false);
  ModalState& m = s_.modal;
  keep_machine([&] { load_system(1); });
  put_system(false);
  if (m.plane != Plane::kXY) {
    m.plane = Plane::kXY;
    put(canon::SelectPlane{Plane::kXY});
  }
  set_great_circle(parts_.config.great_circle);
  m.incremental = false;
  m.arc_absolute = false;
  m.feed_mode = FeedMode::kPerMinute;
  put(canon::SetFeedMode{0});
  m.feed = 0;
  put(canon::SetFeedRate{0});
  if (!m.feed_override) put(PlainCanon::kEnableFeedOverride);
  m.feed_override = m.speed_override = true;
  stop_spindle();
  tell_coolant();
  m.css = false;
  put(canon::SetSpindleMode{0});
  if (m.mist) put(PlainCanon::kMistOff);
  if (m.flood) put(PlainCanon::kFloodOff);
  m.mist = m.flood = false;
  s_.switched_on = s_.switched_off = 0;
  s_.motion = 1_g;
}

}  // namespace trn
