#include "interp/gcode/program_config.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>

#include "interp/gcode/modal.h"

namespace trn {

namespace {

std::string lower_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

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

void read_words(const ConfigTable& table, const char* key, const std::vector<std::string>& fallback,
                WordAction action, std::vector<MappedWord>& words) {
  const ModalTable standard;
  for (const std::string& spelt : table.texts(key, fallback)) {
    MappedWord word{lower_case(spelt), -1, action};
    word.m_code = m_number(word.text);
    if (word.m_code < 0 && !is_word(word.text))
      throw table.error(key, fmt::format("'{}' is no word: M and a number, or at least two letters", spelt));
    if (word.m_code >= ModalTable::kMCodes)
      throw table.error(key, fmt::format("'{}' is out of range: M0 to M{}", spelt, ModalTable::kMCodes - 1));
    if (word.m_code >= 0 && standard.m_group(word.m_code) >= 0)
      throw table.error(key, fmt::format("'{}' already has a meaning of its own", spelt));
    for (const MappedWord& other : words)
      if (other.text == word.text) throw table.error(key, fmt::format("'{}' is mapped twice", spelt));
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
    throw table.error(key, fmt::format("'{}' cannot be a user code; legal: M100 to M999, unused", spelt));
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
    codes.push_back(code);
  }
}

GougeCheckMode read_gouge_check(const ConfigTable& table) {
  const std::string mode = table.choice("gouge_check", {"error", "warning", "off"}, "error");
  return mode == "error"     ? GougeCheckMode::kError
         : mode == "warning" ? GougeCheckMode::kWarning
                             : GougeCheckMode::kOff;
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
    throw table.error(key, fmt::format("'{}' cannot be this code; legal: M100 to M999, unused", spelt));
  return code;
}

ProgramConfig read_program_config(const ConfigTable& root) {
  ProgramConfig config;
  if (const auto io = root.table_if("io")) {
    config.io = true;
    const auto spindle = io->table_if("spindle");
    const bool modbus = io->text("type", "simulated") == "modbus";
    config.spindle_encoder = spindle && spindle->boolean("encoder", !modbus);
    if (modbus && config.spindle_encoder)
      throw spindle->error("encoder", "an inverter on Modbus gives no angle that a thread could follow");
    if (config.spindle_encoder) config.spindle_rpm_s = spindle->number("acceleration_rpm_s", 0, kNotNegative);
  }
  const auto found = root.table_if("program");
  if (!found) return config;
  const ConfigTable& table = *found;
  const std::string mode = table.choice("path_mode", {"G61", "G61.1", "G64"}, "G64");
  config.path_mode = mode == "G61"     ? MotionControl::kExactPath
                     : mode == "G61.1" ? MotionControl::kExactStop
                                       : MotionControl::kContinuous;
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
  config.require_program_end = table.boolean("require_program_end", config.require_program_end);
  config.wrapped_mask = read_wrapped(table);
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
  return config;
}

}  // namespace trn
