#include "interp/gcode/program_config.h"

#include <fast_float/fast_float.h>
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <sstream>

#include "core/letter_case.h"
#include "interp/gcode/modal.h"

namespace trn {

namespace {

// "m428" -> 428; -1 for a word that is not M and digits.
int m_number(const std::string& text) {
  int number = -1;
  if (text.size() < 2 || text[0] != 'm') return -1;
  const auto result = std::from_chars(text.data() + 1, text.data() + text.size(), number);
  return result.ec == std::errc() && result.ptr == text.data() + text.size() ? number : -1;
}

bool is_word(const std::string& text) {
  return text.size() >= 2 && std::isalpha(static_cast<unsigned char>(text[0])) &&
         std::isalpha(static_cast<unsigned char>(text[1])) &&
         std::all_of(text.begin(), text.end(), [](unsigned char c) { return std::isalnum(c) || c == '_'; });
}

// "g5.1" -> G5.1; none for what is not G and a number of at most one decimal.
GCode g_number(const std::string& text) {
  if (text.size() < 2 || text[0] != 'g') return kNoGCode;
  double number = 0;
  const auto result = fast_float::from_chars(text.data() + 1, text.data() + text.size(), number);
  const double rounded = std::round(number * 10);
  const bool whole = result.ec == std::errc() && result.ptr == text.data() + text.size();
  const bool good = whole && std::fabs(rounded - number * 10) < 1e-6 && rounded >= 0;
  return good ? g_from_tenths(static_cast<int>(rounded)) : kNoGCode;
}

// "p10000" -> P and 10000.
bool read_value(const std::string& text, std::pair<char, double>& value) {
  constexpr std::string_view kParameterLetters = "abcdehijklpqrxyz";
  if (text.size() < 2 || kParameterLetters.find(text[0]) == std::string_view::npos) return false;
  value.first = upper_case(text[0]);
  const char* const end = text.data() + text.size();
  const auto result = fast_float::from_chars(text.data() + 1, end, value.second);
  return result.ec == std::errc() && result.ptr == end;
}

// An entry of `ignored` that begins with a G code: "G187", "G5 P10000". False for one that does not.
bool read_ignored_g(const ConfigTable& table, const std::string& spelt, std::vector<MappedWord>& words) {
  std::istringstream parts(lower_case(spelt));
  MappedWord word{lower_case(spelt), -1, WordAction::kIgnore};
  std::string part;
  parts >> part;
  word.g_code = g_number(part);
  if (word.g_code == kNoGCode) return false;
  while (parts >> part)
    if (!read_value(part, word.values.emplace_back()))
      throw table.error("ignored", fmt::format("'{}' in '{}' is no word with a number, as P1", part, spelt));
  if (!ModalTable::in_range(word.g_code))
    throw table.error("ignored",
                      fmt::format("'{}' is out of range: G0 to G{}", spelt, ModalTable::kGCodes / 10 - 1));
  word.alone = ModalTable().g_group(word.g_code) >= 0;
  if (word.alone && word.values.empty())
    throw table.error("ignored", fmt::format("'{}' already has a meaning of its own; with the words that it "
                                             "stands with ('{} P1') only that line is ignored",
                                             spelt, spelt));
  words.push_back(std::move(word));
  return true;
}

void read_words(const ConfigTable& table, const char* key, const std::vector<std::string>& fallback,
                WordAction action, std::vector<MappedWord>& words) {
  const ModalTable standard;
  for (const std::string& spelt : table.texts(key, fallback)) {
    for (const MappedWord& other : words)
      if (other.text == lower_case(spelt)) throw table.error(key, fmt::format("'{}' is mapped twice", spelt));
    if (action == WordAction::kIgnore && read_ignored_g(table, spelt, words)) continue;
    MappedWord word{lower_case(spelt), -1, action};
    word.m_code = m_number(word.text);
    if (word.m_code < 0 && !is_word(word.text))
      throw table.error(key,
                        fmt::format("'{}' is no word: M and a number, or at least two letters{}", spelt,
                                    action == WordAction::kIgnore ? ", or G, a number and its words" : ""));
    if (word.m_code >= ModalTable::kMCodes)
      throw table.error(key, fmt::format("'{}' is out of range: M0 to M{}", spelt, ModalTable::kMCodes - 1));
    if (word.m_code >= 0 && standard.m_group(word.m_code) >= 0)
      throw table.error(key, fmt::format("'{}' already has a meaning of its own", spelt));
    words.push_back(std::move(word));
  }
}

unsigned read_wrapped(const ConfigTable& table) {
  unsigned mask = 0;
  for (const std::string& axis : table.texts("wrapped", {})) {
    const std::string legal = "ABC";
    const auto at = axis.size() == 1 ? legal.find(axis[0]) : std::string::npos;
    if (at == std::string::npos)
      throw table.error("wrapped", fmt::format("'{}' is no rotary axis; legal: A, B, C", axis));
    mask |= 1U << (static_cast<unsigned>(kA) + static_cast<unsigned>(at));
  }
  return mask;
}

int user_code(const ConfigTable& table, std::string_view key, const std::string& spelt) {
  const ModalTable standard;
  const int code = m_number(lower_case(spelt));
  if (code < 0 || code >= ModalTable::kMCodes || standard.m_group(code) >= 0)
    throw table.error(key, fmt::format("'{}' cannot be a user code; legal: M0 to M999, unused", spelt));
  return code;
}

void read_user_m(const ConfigTable& table, std::vector<UserCode>& codes) {
  for (const std::string& spelt : table.texts("user_m", {}))
    codes.push_back({user_code(table, "user_m", spelt), "", -1, true});
  for (const ConfigTable& entry : table.tables_if("m_code")) {
    UserCode code;
    code.code = user_code(entry, "code", entry.text("code"));
    code.call = lower_case(entry.text("call", ""));
    if (entry.has("output")) code.output = static_cast<int>(entry.integer("output", Range{0, 63}));
    code.on = entry.boolean("on", true);
    if (code.call.empty() == (code.output < 0))
      throw entry.error("code", fmt::format("M{} needs either call or output", code.code));
    for (const UserCode& other : codes)
      if (other.code == code.code) throw entry.error("code", fmt::format("M{} is there already", code.code));
    codes.push_back(code);
  }
}

GougeCheckMode read_gouge_check(const ConfigTable& table) {
  const std::string mode = table.choice("gouge_check", {"error", "warning", "off"}, "error");
  return mode == "error"     ? GougeCheckMode::kError
         : mode == "warning" ? GougeCheckMode::kWarning
                             : GougeCheckMode::kOff;
}

void read_tangential(const ConfigTable& table, ProgramConfig& config) {
  TangentialConfig& out = config.tangential;
  out.axis = kA + static_cast<int>(table.choice("axis", {"A", "B", "C"}, "C")[0] - 'A');
  out.corner_deg = table.number("corner_deg", out.corner_deg, Range{0.1, 180});
  out.blend_deg = table.number("blend_deg", out.blend_deg, Range{0, 20});
  if (out.blend_deg > out.corner_deg)
    throw table.error("blend_deg",
                      "corners from blend_deg to corner_deg turn on the spot; blend_deg is the smaller");
  out.lift_mm = table.number("lift_mm", out.lift_mm, kPositive);
  read_words(table, "on", {"TANGON"}, WordAction::kKnifeOn, config.words);
  read_words(table, "off", {"TANGOF"}, WordAction::kKnifeOff, config.words);
}

void read_spindle_axis(const ConfigTable& table, ProgramConfig& config) {
  SpindleAxisConfig& out = config.spindle_axis;
  out.axis = kA + static_cast<int>(table.choice("axis", {"A", "B", "C"}, "C")[0] - 'A');
  out.sense = table.choice("m3", {"negative", "positive"}, "negative") == "positive" ? 1 : -1;
  read_words(table, "axis_on", {"M154"}, WordAction::kSpindleIsAxis, config.words);
  read_words(table, "axis_off", {"M155"}, WordAction::kAxisIsSpindle, config.words);
  config.spindle_encoder = true;
}

// A key that belongs to another answer of `confirm` is a mistake.
void read_tool_change(const ConfigTable& root, ProgramConfig& config) {
  const auto table = root.table_if("tool_change");
  if (!table) return;
  const std::vector<std::string> answers = {"operator", "input", "sub-program", "none"};
  const std::string confirm = table->choice("confirm", answers, answers.front());
  for (std::size_t i = 0; i < answers.size(); ++i)
    if (confirm == answers[i]) config.tool_confirm = static_cast<ToolConfirm>(i);
  const struct {
    const char* key;
    ToolConfirm owner;
    std::size_t answer;
  } kOwned[] = {{"input", ToolConfirm::kInput, 1}, {"call", ToolConfirm::kSubProgram, 2}};
  for (const auto& owned : kOwned)
    if (table->has(owned.key) && config.tool_confirm != owned.owner)
      throw table->error(owned.key,
                         fmt::format("'{}' goes with confirm = \"{}\"", owned.key, answers[owned.answer]));
  if (config.tool_confirm == ToolConfirm::kInput) {
    config.tool_input = static_cast<int>(table->integer("input", Range{0, 63}));
    if (!config.io) throw table->error("input", "the machine has no inputs; add a section [io]");
  }
  if (config.tool_confirm != ToolConfirm::kSubProgram) return;
  config.tool_call = lower_case(table->text("call"));
  if (config.tool_call.empty())
    throw table->error("call", "'call' names the sub-program that changes the tool");
}

void read_io(const ConfigTable& root, ProgramConfig& config) {
  if (const auto io = root.table_if("io")) {
    config.io = true;
    const auto spindle = io->table_if("spindle");
    const bool modbus = io->text("type", "simulated") == "modbus";
    config.spindle_encoder = spindle && spindle->boolean("encoder", !modbus);
    if (modbus && config.spindle_encoder)
      throw spindle->error("encoder", "an inverter on Modbus gives no angle that a thread could follow");
    const double rpm_max = spindle ? spindle->number("rpm_max", 0, kNotNegative) : 0;
    if (rpm_max > 0) config.spindle_rpm_max = rpm_max;
    if (config.spindle_encoder) config.spindle_rpm_s = spindle->number("acceleration_rpm_s", 0, kNotNegative);
  }
}

void read_program(const ConfigTable& table, ProgramConfig& config) {
  const std::string mode = table.choice("path_mode", {"G61", "G61.1", "G64"}, "G64");
  config.path_mode = mode == "G61"     ? MotionControl::kExactPath
                     : mode == "G61.1" ? MotionControl::kExactStop
                                       : MotionControl::kContinuous;
  config.inch = table.choice("units", {"mm", "inch"}, "mm") == "inch";
  config.tolerance_mm = table.number("tolerance_mm", config.tolerance_mm, kPositive);
  config.tolerance_deg = table.number("tolerance_deg", config.tolerance_deg, kPositive);
  config.arc_tolerance_mm = table.number("arc_tolerance_mm", config.arc_tolerance_mm, kNotNegative);
  config.arc_tolerance_share = table.number("arc_tolerance_share", config.arc_tolerance_share, Range{0, 0.1});
  config.gouge_check = read_gouge_check(table);
  config.peck_clearance_mm = table.number("peck_clearance_mm", config.peck_clearance_mm, kNotNegative);
  config.g183_retract_mm = table.number("g183_retract_mm", config.g183_retract_mm, kNotNegative);
  if (table.has("safe_z_mm")) config.safe_z_mm = table.number("safe_z_mm");
  config.block_delete = table.boolean("block_delete", config.block_delete);
  config.optional_stop = table.boolean("optional_stop", config.optional_stop);
  config.dry_run_up_mm = table.number("dry_run_up_mm", config.dry_run_up_mm, kNotNegative);
  if (table.has("end_required"))
    config.end = table.boolean("end_required") ? ProgramEnd::kRequired : ProgramEnd::kFree;
  config.wrapped_mask = read_wrapped(table);
  config.wrapped_by_sign = table.choice("wrapped_way", {"short", "sign"}, "short") == "sign";
  config.great_circle = table.boolean("great_circle", config.great_circle);
  config.words.clear();
  read_words(table, "rtcp_on", {}, WordAction::kRtcpOn, config.words);
  read_words(table, "rtcp_off", {}, WordAction::kRtcpOff, config.words);
  read_words(table, "great_circle_on", {"ORIVECT"}, WordAction::kGreatCircle, config.words);
  read_words(table, "great_circle_off", {"ORIAXES"}, WordAction::kAxisPath, config.words);
  read_words(table, "ignored", {"CYCLE832"}, WordAction::kIgnore, config.words);
  read_user_m(table, config.user_m);
  config.sub_path = table.texts("sub_path", config.sub_path);
  config.line_length_max = static_cast<std::size_t>(
      table.integer("line_length_max", static_cast<long>(config.line_length_max), Range{80, 16e6}));
  config.sub_depth_max =
      static_cast<int>(table.integer("sub_depth_max", config.sub_depth_max, Range{1, 1000}));
}

}  // namespace

const SwitchCode* find_switch(const ProgramConfig& config, int code) {
  for (const SwitchCode& s : config.switches)
    if (s.m_code == code) return &s;
  return nullptr;
}

int read_free_m(const ConfigTable& table, std::string_view key, const ProgramConfig& config) {
  const ModalTable standard;
  const std::string spelt = table.text(key);
  const int code = m_number(lower_case(spelt));
  bool taken = code < 0 || code >= ModalTable::kMCodes || standard.m_group(code) >= 0;
  for (const MappedWord& word : config.words) taken |= word.m_code == code;
  for (const UserCode& user : config.user_m) taken |= user.code == code;
  if (taken || find_switch(config, code))
    throw table.error(key, fmt::format("'{}' cannot be this code; legal: M0 to M999, unused", spelt));
  return code;
}

ProgramConfig read_program_config(const ConfigTable& root) {
  ProgramConfig config;
  read_io(root, config);
  read_tool_change(root, config);
  if (const auto program = root.table_if("program")) read_program(*program, config);
  if (const auto tangential = root.table_if("tangential")) read_tangential(*tangential, config);
  if (const auto spindle = root.table_if("spindle_axis")) read_spindle_axis(*spindle, config);
  return config;
}

}  // namespace trn
