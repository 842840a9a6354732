#include "app/session/place_record.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <type_traits>
#include <vector>

#include "app/session/block_delete_json.h"
#include "app/session/measured_json.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/path.h"
#include "core/units.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/lowering.h"
#include "interp/gcode/measured_values.h"
#include "interp/gcode/parameter_file.h"
#include "interp/move.h"

namespace trn {

namespace {

constexpr double kLeast_mm = 0.001;  // less of a line is none

/// How long the path has become, mm of the tip.
struct PathLength : MoveSink {
  void move(const ProgramMove& move) override {
    mm += tip_length_mm(move);
    to.push_back(move.to);
    only = to.size() == 1 && move.kind != ProgramMove::Kind::kTraverse ? std::optional(move) : std::nullopt;
  }
  void event(const QueueEvent&, SourceLine) override {}
  double mm = 0;
  std::vector<Words> to;            ///< ends of the moves of the block that was run last
  std::optional<ProgramMove> only;  ///< the one move of that block, if it feeds
};

/// The one move of a block, a straight feed or an arc, that may be entered within.
struct CutMove {
  ProgramMove move;
  ProgramFrame frame;  ///< of its words
  double mm = 0;
  bool is_arc() const { return move.kind == ProgramMove::Kind::kArc; }
  EntryPlace at(double gone_mm) const {
    const double share = gone_mm / mm;
    if (!is_arc()) return {frame.mm_of(move.from + share * (move.to - move.from)), 0};
    const PathPiece arc = make_arc(move.from, move.to, move.arc_centre, move.arc_axis, move.arc_sweep_rad);
    return {frame.mm_of(arc.at(share * arc.length)), share};
  }
  double gone_mm(const PlaceRecord& place) const;
};

// How far along it the place is. The angle on an arc tells it exactly but for whole turns.
double CutMove::gone_mm(const PlaceRecord& place) const {
  const double about_mm = std::clamp(place.left_mm >= 0 ? mm - place.left_mm : place.gone_mm, 0.0, mm);
  if (!is_arc() || !place.at) return about_mm;
  const auto in_program = [this](const Vec3& place_T) {
    Words words = move.from;
    words.head<3>() = place_T;
    return frame.mm_of(words).xyz;
  };
  const Vec3 centre = in_program(move.arc_centre);
  const Vec3 axis = in_program(move.arc_centre + move.arc_axis) - centre;
  const auto radial = [&](const Vec3& at) { return Vec3(at - centre - axis * axis.dot(at - centre)); };
  const Vec3 first = radial(in_program(move.from.head<3>())), now = radial(place.at->xyz);
  const double sweep = std::abs(move.arc_sweep_rad), sign = move.arc_sweep_rad > 0 ? 1 : -1;
  const double angle = sign * std::atan2(axis.dot(first.cross(now)), first.dot(now));
  const double about = about_mm / mm * sweep;
  const double turned = angle + 2 * kPi * std::round((about - angle) / (2 * kPi));
  return std::clamp(turned / sweep, 0.0, 1.0) * mm;
}

// None where something else than the way from here to there may be meant, and where the block changes what
// its coordinates count from.
std::optional<CutMove> cut_move(const ProgramReader& reader, const MmWords& stood, const PathLength& path) {
  if (!path.only || path.only->duration_s > 0) return std::nullopt;
  const CutMove cut{*path.only, reader.frame(), tip_length_mm(*path.only)};
  const GCode motion = reader.interpreter().motion();
  if (cut.is_arc() ? motion != 2_g && motion != 3_g : motion != 1_g) return std::nullopt;
  constexpr double kSamePlace = 1e-6;  // mm, degrees
  const MmWords from = cut.frame.mm_of(cut.move.from), to = cut.frame.mm_of(cut.move.to);
  const bool same =
      (from.xyz - stood.xyz).norm() < kSamePlace && (from.abc_deg - stood.abc_deg).norm() < kSamePlace;
  const bool turns = (to.abc_deg - from.abc_deg).norm() > kSamePlace;
  if (!same || (turns && reader.interpreter().settings().modal.great_circle)) return std::nullopt;
  return cut;
}

/// A beginning of a block, and its move if it has one that may be entered.
struct Beginning {
  PlaceEntry entry;  ///< before_mm: of the path before it
  std::optional<CutMove> move;
};

// Offsets and the tool's length may be others by now: the program's own coordinates count.
bool comes_to(const ProgramReader& reader, const std::vector<Words>& ends, const MmWords& to) {
  constexpr double kSamePlace = 1e-4;  // mm, degrees
  return std::any_of(ends.begin(), ends.end(), [&](const Words& end) {
    const MmWords there = reader.program_of(end);
    return (there.xyz - to.xyz).norm() < kSamePlace && (there.abc_deg - to.abc_deg).norm() < kSamePlace;
  });
}

void refuse_other_setting(const Parameters& parameters, const ProgramStart& start, const PlaceRecord& place) {
  const int tool = static_cast<int>(parameters[parameter::kTool]);
  if (tool != place.tool)
    throw ProgramError(fmt::format(
        "tool {} is in the spindle, and the program was given up with tool {}; put that in and say so with "
        "'trunnion tool {} --in-spindle'",
        tool, place.tool, place.tool));
  if (start.switches.block_delete != place.block_delete ||
      start.switches.optional_stop != place.optional_stop)
    throw ProgramError(fmt::format(
        "the program ran with block delete {} and optional stop {}; switch them so, and ask again",
        place.block_delete ? "on" : "off", place.optional_stop ? "on" : "off"));
}

[[noreturn]] void refuse_other_way(const PlaceRecord& place, const std::string& what) {
  throw ProgramError(
      fmt::format("the program does not come to the recorded line {} ('{}') again: {}; begin it with "
                  "'trunnion start --from LINE'",
                  place.line, place.text, what));
}

// At the stop the machine stayed where it was; as the program is read now, the offset counts from its start.
std::string why_elsewhere(const PlaceRecord& place) {
  const auto& numbers = place.measured.numbers;
  const bool at_stop =
      std::any_of(numbers.begin(), numbers.end(), [](const auto& set) { return set.second.until_block > 0; });
  return at_stop
             ? "offsets were set at a stop, and no line has named every axis since, or variables have changed"
             : "variables have changed";
}

std::string name_of_number(int number) {
  if (number == parameter::kTool) return "the tool in the spindle";
  const int k = number >= parameter::kFirstOffset
                    ? (number - parameter::kFirstOffset) % parameter::kOffsetStride
                    : number - (number >= parameter::kG30 ? parameter::kG30 : parameter::kG28);
  const std::string word =
      k == parameter::kOffsetRotation ? "the rotation" : std::string(1, k <= kC ? kWordLetters[k] : '?');
  if (number < parameter::kFirstOffset)
    return fmt::format("{} of G{}", word, number >= parameter::kG30 ? 30 : 28);
  const auto system = static_cast<std::size_t>((number - parameter::kFirstOffset) / parameter::kOffsetStride);
  return fmt::format("{} of {}", word, g_name(kWorkOffsetCodes[system]));
}

std::string kept_text(const Interpreter& interpreter) {
  std::vector<std::string> kept;
  for (const auto& [number, line] : interpreter.kept_numbers())
    kept.push_back(fmt::format("{} (line {})", name_of_number(number), line));
  for (const auto& [number, line] : interpreter.kept_tools())
    kept.push_back(fmt::format("tool {} (line {})", number, line));
  return fmt::format("{}", fmt::join(kept, ", "));
}

/// Beginnings of blocks from which the place may be approached; the first is the one that is far enough.
class Entries {
 public:
  explicit Entries(double needed_mm) : needed_mm_(needed_mm) {}
  void begin(const Beginning& beginning) { open_.push_back(beginning); }
  /// `at_mm`: the place is there or later.
  void pass(double at_mm) {
    while (open_.size() > 1 && at_mm - open_[1].entry.before_mm >= needed_mm_) open_.pop_front();
  }
  const Beginning& found() const { return open_.front(); }

 private:
  double needed_mm_;
  std::deque<Beginning> open_;
};

/// Calls `use` with every field and its key, in the order of the file.
template <class Record, class Use>
void each_field(Record& place, const Use& use) {
  use("program", place.program);
  use("mark", place.mark);
  use("ended", place.ended);
  use("block", place.block);
  use("line", place.line);
  use("file", place.file);
  use("text", place.text);
  use("gone_mm", place.gone_mm);
  use("left_mm", place.left_mm);
  use("moves", place.moves);
  use("to", place.to);
  use("at", place.at);
  use("tool", place.tool);
  use("codes", place.codes);
  use("work_offset", place.work_offset);
  use("spindle_rpm", place.spindle_rpm);
  use("coolant", place.coolant);
  use("work", place.work);
  use("block_delete", place.block_delete);
  use("optional_stop", place.optional_stop);
  use("block_delete_changes", place.block_delete_changes);
  use("began", place.began);
  use("measured", place.measured);
}

JointVec joints_from(const std::vector<double>& numbers, const std::string& name) {
  if (numbers.size() > static_cast<std::size_t>(kMaxJoints))
    throw ProgramError(fmt::format("{}: no record of a place: too many joints", name));
  return Eigen::Map<const Eigen::VectorXd>(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
}

MmWords six_words(const nlohmann::json& json, const std::string& name) {
  const auto words = json.get<std::vector<double>>();
  if (words.size() != 6) throw ProgramError(fmt::format("{}: no record of a place: six words", name));
  MmWords out;
  for (int i = kX; i <= kC; ++i) out[i] = words[static_cast<std::size_t>(i)];
  return out;
}

}  // namespace

std::string place_file_text(const PlaceRecord& place) {
  nlohmann::ordered_json json;
  each_field(place, [&](const char* key, const auto& value) {
    if constexpr (std::is_same_v<decltype(value), const MmWords&>)
      for (int i = kX; i <= kC; ++i) json[key].push_back(value[i]);
    else if constexpr (std::is_same_v<decltype(value), const std::optional<MmWords>&>)
      for (int i = kX; value && i <= kC; ++i) json[key].push_back((*value)[i]);
    else if constexpr (std::is_same_v<decltype(value), const std::vector<BlockDeleteChange>&>)
      json[key] = changes_json(value);
    else if constexpr (std::is_same_v<decltype(value), const MeasuredValues&>)
      json[key] = measured_json(value);
    else if constexpr (std::is_same_v<decltype(value), const JointVec&>)
      json[key] = std::vector<double>(value.begin(), value.end());
    else
      json[key] = value;
  });
  return json.dump(1, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

PlaceRecord parse_place(std::string_view text, const std::string& name) {
  try {
    const nlohmann::json json = nlohmann::json::parse(text);
    PlaceRecord place;
    each_field(place, [&](const char* key, auto& value) {
      if constexpr (std::is_same_v<decltype(value), MmWords&>) {
        value = six_words(json.at(key), name);
      } else if constexpr (std::is_same_v<decltype(value), std::optional<MmWords>&>) {
        if (json.contains(key)) value = six_words(json.at(key), name);
      } else if constexpr (std::is_same_v<decltype(value), std::vector<BlockDeleteChange>&>) {
        if (json.contains(key)) value = changes_from(json.at(key));
      } else if constexpr (std::is_same_v<decltype(value), MeasuredValues&>) {
        if (json.contains(key)) value = measured_from(json.at(key));
      } else if constexpr (std::is_same_v<decltype(value), JointVec&>) {
        value = joints_from(json.value(key, std::vector<double>()), name);
      } else if (std::string_view(key) == "left_mm" && !json.contains(key)) {
        return;  // of an earlier version
      } else {
        json.at(key).get_to(value);
      }
    });
    return place;
  } catch (const ProgramError&) {
    throw;
  } catch (const std::exception& error) {  // of JSON, or of what the operator measured
    throw ProgramError(fmt::format("{}: no record of a place: {}", name, error.what()));
  }
}

PlaceRecord read_place(const std::string& path) {
  if (!std::filesystem::exists(path))
    throw ProgramError(
        fmt::format("{}: no program was under way on this machine; 'load' and 'start' one", path));
  return parse_place(read_text_file(path), path);
}

void refuse_without_place(const PlaceRecord& place) {
  if (place.ended)
    throw ProgramError(fmt::format(
        "{} has come to its end; there is nothing to go on with, 'start' begins it anew", place.program));
  if (place.block == 0)
    throw ProgramError(
        fmt::format("{} was started, but had not begun its first line; there is no place to go on from, "
                    "'start' begins it",
                    place.program));
}

PlaceEntry find_entry(const Assembly& assembly, Parameters parameters, ToolTable tools,
                      const ProgramStart& start, const PlaceRecord& place, double before_mm) {
  refuse_other_setting(parameters, start, place);
  PathLength path;
  Entries entries(before_mm);
  ProgramReader reader(assembly, parameters, tools, start, path);
  const Interpreter& interpreter = reader.interpreter();
  double place_mm = place.gone_mm;
  while (interpreter.blocks() < place.block) {
    const bool begins = interpreter.between_blocks();
    const bool may_enter = begins && interpreter.cutter_comp() == 40_g;
    const std::uint64_t before = interpreter.blocks();
    const double at_mm = path.mm;
    place_mm = at_mm + place.gone_mm;
    path.to.clear();
    path.only.reset();
    const MmWords stood = reader.stands();
    if (!reader.step() && interpreter.blocks() < place.block) refuse_other_way(place, "it ends before");
    if (interpreter.waiting() && interpreter.blocks() < place.block)
      refuse_other_way(place, fmt::format("line {} asks the machine (M66, G38)", interpreter.line()));
    const std::optional<CutMove> move = cut_move(reader, stood, path);
    if (begins && (may_enter || before == 0)) entries.begin({{before + 1, interpreter.line(), at_mm}, move});
    // It may have been begun on its move, too: then what is left tells the place.
    if (move) place_mm = at_mm + move->gone_mm(place);
    entries.pass(interpreter.blocks() < place.block ? at_mm : place_mm);
  }
  // Cutter compensation holds moves back: then the line is not known.
  const bool same = interpreter.line() == place.line && interpreter.text().rfind(place.text, 0) == 0;
  if (!place.text.empty() && !same)
    refuse_other_way(place,
                     fmt::format("it is in line {} by then, for variables or a sub-program have changed",
                                 interpreter.line()));
  if (place.moves && !comes_to(reader, path.to, place.to))
    refuse_other_way(place, fmt::format("it comes to another place there, for {}", why_elsewhere(place)));
  PlaceEntry found = entries.found().entry;
  found.before_mm = place_mm - found.before_mm;
  found.kept = kept_text(interpreter);
  const std::optional<CutMove>& move = entries.found().move;
  const double on_move_mm = move ? std::min(found.before_mm - before_mm, move->mm - kLeast_mm) : 0;
  if (on_move_mm < kLeast_mm) return found;
  found.on_move_mm = on_move_mm;
  found.before_mm -= on_move_mm;
  found.place = move->at(on_move_mm);
  return found;
}

std::string place_text(const PlaceRecord& place, const PlaceEntry& entry) {
  std::string text = fmt::format("it was in line {} of {}: {}\n", place.line, place.file, place.text);
  text += fmt::format("  work {}\n  {}\n  {}, spindle {:g} rpm, coolant {}\n", place.work, place.codes,
                      place.work_offset, place.spindle_rpm,
                      place.coolant == 0   ? "off"
                      : place.coolant == 1 ? "mist"
                      : place.coolant == 2 ? "flood"
                                           : "mist and flood");
  if (!entry.kept.empty())
    text += fmt::format("  as you have set it since, though a line of the program sets it: {}\n", entry.kept);
  if (entry.place)
    return text + fmt::format(
                      "it goes on in line {}, {:.1f} mm behind its beginning, and cuts {:.1f} mm before that "
                      "place again: the spindle and the coolant first, then the approach;\n",
                      entry.line, entry.on_move_mm, entry.before_mm);
  return text + fmt::format(
                    "it goes on with line {} from its beginning, at least {:.1f} mm of the path before that: "
                    "the spindle and "
                    "the coolant first, then the approach;\n",
                    entry.line, entry.before_mm);
}

}  // namespace trn
