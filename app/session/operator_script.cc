#include "app/session/operator_script.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <sstream>

#include "app/client/command_table.h"
#include "app/session/tick_commands.h"
#include "core/plain_file.h"
#include "interp/move.h"

namespace trn {

namespace {

const TickCommandRow& row_of(const std::string& action) {
  std::vector<std::string_view> actions;
  for (const TickCommandRow& row : kTickCommands) {
    if (row.action.empty()) continue;
    if (action == row.action) return row;
    actions.push_back(row.action);
  }
  throw ProgramError(fmt::format("'{}' is no action; there are {}", action, fmt::join(actions, ", ")));
}

double value_of(const TickCommandRow& row, std::istringstream& in) {
  if (row.value == ScriptValue::kNone) return 0;
  if (row.value == ScriptValue::kSwitch) {
    std::string state;
    in >> state;
    if (state != "on" && state != "off") throw ProgramError(fmt::format("{} takes on or off", row.action));
    return state == "on";
  }
  double percent = -1;
  const double percent_max = 100 * setting_max(row.name);
  if (!(in >> percent) || !(percent >= 0 && percent <= percent_max))
    throw ProgramError(fmt::format("{} takes a percentage, 0 to {:g}", row.action, percent_max));
  return percent / 100;
}

OperatorAction action_of(const std::string& text) {
  std::istringstream in(text);
  OperatorAction action;
  std::string name, rest;
  if (!(in >> action.time_s >> name) || !(action.time_s >= 0))
    throw ProgramError("a line is SECONDS ACTION [VALUE], e.g. '1.5 override 50'");
  const TickCommandRow& row = row_of(name);
  action.command.kind = row.kind;
  action.command.value = value_of(row, in);
  if (in >> rest) throw ProgramError(fmt::format("'{}' is too much", rest));
  return action;
}

}  // namespace

std::vector<OperatorAction> parse_operator_script(std::string_view text, const std::string& name) {
  std::istringstream in{std::string(text)};
  std::vector<OperatorAction> script;
  std::string words;
  for (int line = 1; std::getline(in, words); ++line) {
    words.resize(std::min(words.size(), words.find('#')));
    if (words.find_first_not_of(" \t\r") == std::string::npos) continue;
    try {
      script.push_back(action_of(words));
      if (script.size() > 1 && script.back().time_s < script[script.size() - 2].time_s)
        throw ProgramError("this is before the line above; put the actions in order of time");
    } catch (const ProgramError& error) {
      throw ProgramError(fmt::format("{}:{}: {}", name, line, error.what()));
    }
  }
  return script;
}

std::vector<OperatorAction> read_operator_script(const std::string& path) {
  try {
    return parse_operator_script(read_named_file(path), path);
  } catch (const PlainFileError& error) {
    throw ProgramError(error.what());
  }
}

}  // namespace trn
