#include "app/session/operator_script.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <fstream>
#include <sstream>

#include "interp/move.h"

namespace trn {

namespace {

enum class Value : unsigned char { kNone, kPercent, kSwitch };

struct Word {
  const char* name;
  RtCommand::Kind kind;
  Value value;
  double percent_max;
};

constexpr Word kWords[] = {
    {"hold", RtCommand::Kind::kHold, Value::kNone, 0},
    {"resume", RtCommand::Kind::kResume, Value::kNone, 0},
    {"stop", RtCommand::Kind::kStop, Value::kNone, 0},
    {"override", RtCommand::Kind::kOverride, Value::kPercent, 200},
    {"rapid", RtCommand::Kind::kRapidOverride, Value::kPercent, 100},
    {"spindle", RtCommand::Kind::kSpindleOverride, Value::kPercent, 200},
    {"adaptive", RtCommand::Kind::kAdaptiveFeed, Value::kPercent, 100},
    {"step", RtCommand::Kind::kSingleBlock, Value::kSwitch, 0},
};

const Word& word_of(const std::string& name) {
  std::vector<std::string> names;
  for (const Word& word : kWords) {
    if (name == word.name) return word;
    names.emplace_back(word.name);
  }
  throw ProgramError(fmt::format("'{}' is no action; there are {}", name, fmt::join(names, ", ")));
}

double value_of(const Word& word, std::istringstream& in) {
  if (word.value == Value::kNone) return 0;
  if (word.value == Value::kSwitch) {
    std::string state;
    in >> state;
    if (state != "on" && state != "off") throw ProgramError(fmt::format("{} takes on or off", word.name));
    return state == "on";
  }
  double percent = -1;
  if (!(in >> percent) || !(percent >= 0 && percent <= word.percent_max))
    throw ProgramError(fmt::format("{} takes a percentage, 0 to {:g}", word.name, word.percent_max));
  return percent / 100;
}

OperatorAction action_of(const std::string& text) {
  std::istringstream in(text);
  OperatorAction action;
  std::string name, rest;
  if (!(in >> action.time_s >> name) || !(action.time_s >= 0))
    throw ProgramError("a line is SECONDS ACTION [VALUE], e.g. '1.5 override 50'");
  const Word& word = word_of(name);
  action.command.kind = word.kind;
  action.command.value = value_of(word, in);
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
  std::ifstream in(path);
  if (!in) throw ProgramError(fmt::format("{}: cannot be read", path));
  std::ostringstream text;
  text << in.rdbuf();
  return parse_operator_script(text.str(), path);
}

}  // namespace trn
