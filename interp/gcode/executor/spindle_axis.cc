#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "core/axes.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/settings.h"
#include "interp/gcode/text/block.h"

// A spindle whose drive is an axis as well ([spindle_axis]). At the start of a program it is a spindle.
namespace trn {

/// The first word of the config that does this, for messages.
std::string Executor::spindle_axis_word(WordAction action) const {
  std::string text;
  for (const MappedWord& word : parts_.config.words)
    if (word.action == action && text.empty()) text = word.text;
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
  return text;
}

// The spindle stops and turns to where the axis stands in the program. It is never switched over while it
// turns.
void Executor::switch_spindle_axis(bool on) {
  if (on == s_.spindle_is_axis) return;
  if (on && s_.modal.turn != SpindleTurn::kStopped) stop_spindle();
  s_.spindle_is_axis = on;
  const SpindleAxisConfig& config = parts_.config.spindle_axis;
  const double deg = frame().to_machine(to_mm(s_.position))[config.axis];
  put(canon::SetSpindleAxis{on,
                            on ? config.sense * config.word_sense * std::remainder(deg, 360.0) + 0.0 : 0});
}

// Looked at before the block is carried out and, as its own words may switch over, behind them.
void Executor::check_spindle_axis(const Block& b, GCode motion, bool before) const {
  const SpindleAxisConfig& config = parts_.config.spindle_axis;
  const char letter = kWordLetters[config.axis];
  if (b.has('S') && b['S'] > config.rpm_max && s_.modal.css == false)
    fail(GcodeErrorCode::kBadValue, b.at('S'), 'S', b['S'], "the spindle's joint",
         fmt::format("{:.0f} rpm at most, as its velocity in the config says", config.rpm_max));
  if (!s_.spindle_is_axis) {
    const std::string remedy = fmt::format("it is a spindle now; {} makes an axis of it",
                                           spindle_axis_word(WordAction::kSpindleIsAxis));
    const bool switches = before && ((b.any_m && b.has(MGroup::kRtcp)) || !b.parsed->keywords.empty());
    const bool offset =
        other_axis_code(b) && b.code(GGroup::kNonModal) != 28_g && b.code(GGroup::kNonModal) != 30_g;
    if (b.has(letter) && !offset && !switches)
      fail(GcodeErrorCode::kSpindleAxis, b.at(letter), fmt::format("a word {}", letter), remedy);
    if (motion == 33.1_g)
      fail(GcodeErrorCode::kSpindleAxis, b.motion_column(), "G33.1",
           fmt::format("tap with an axis: {}, then both together, as G1 Z-10 {}-3600",
                       spindle_axis_word(WordAction::kSpindleIsAxis), letter));
    const GCode home = b.code(GGroup::kNonModal);
    if ((home == 28_g || home == 30_g) && !b.has_axis_word())
      fail(GcodeErrorCode::kSpindleAxis, b.at(GGroup::kNonModal), g_name(home),
           fmt::format("{} would move; name the other axes, as in G28 Z0", letter));
    return;
  }
  const std::string remedy =
      fmt::format("the spindle is an axis now; {} first", spindle_axis_word(WordAction::kAxisIsSpindle));
  if (b.has('S')) fail(GcodeErrorCode::kSpindleAxis, b.at('S'), "S", remedy);
  const int code = b.any_m ? b.code(MGroup::kSpindle) : -1;
  if (code == 3 || code == 4 || code == 19)
    fail(GcodeErrorCode::kSpindleAxis, b.at(MGroup::kSpindle), fmt::format("M{}", code), remedy);
  for (const GCode geared : {33_g, 33.1_g, 76_g, 74_g, 84_g, 86_g, 87_g, 88_g})
    if (motion == geared) fail(GcodeErrorCode::kSpindleAxis, b.motion_column(), g_name(motion), remedy);
}

}  // namespace trn
