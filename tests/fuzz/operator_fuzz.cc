#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "app/session/operator_script.h"
#include "interp/move.h"
#include "kernel/rt_messages.h"
#include "tests/fuzz/require.h"

// Fuzz target: any bytes as an operator's script. What is accepted is in order of time and within its ranges,
// and is the same when it is written and read again; an error names file and line.
namespace {

using namespace trn;
using fuzz::require;
using Kind = RtCommand::Kind;

constexpr const char* kFile = "fuzz.op";

std::string words_of(const RtCommand& command) {
  switch (command.kind) {
    case Kind::kHold:
      return "hold";
    case Kind::kResume:
      return "resume";
    case Kind::kStop:
      return "stop";
    case Kind::kOverride:
      return fmt::format("override {}", command.value * 100);
    case Kind::kRapidOverride:
      return fmt::format("rapid {}", command.value * 100);
    case Kind::kSpindleOverride:
      return fmt::format("spindle {}", command.value * 100);
    case Kind::kAdaptiveFeed:
      return fmt::format("adaptive {}", command.value * 100);
    case Kind::kSingleBlock:
      return command.value == 1 ? "step on" : "step off";
    default:
      require(false, "an action of a script");
      return "";
  }
}

double most_of(Kind kind) { return kind == Kind::kOverride || kind == Kind::kSpindleOverride ? 2 : 1; }

void judge(const std::vector<OperatorAction>& script) {
  std::string text;
  double last_s = 0;
  for (const OperatorAction& action : script) {
    require(std::isfinite(action.time_s) && action.time_s >= last_s, "in order of time");
    require(action.command.value >= 0 && action.command.value <= most_of(action.command.kind),
            "in its range");
    last_s = action.time_s;
    text += fmt::format("{} {}\n", action.time_s, words_of(action.command));
  }
  const std::vector<OperatorAction> again = parse_operator_script(text, kFile);
  require(again.size() == script.size(), "as many actions again");
  for (std::size_t i = 0; i < script.size(); ++i) {
    require(again[i].time_s == script[i].time_s, "the time again");
    require(again[i].command.kind == script[i].command.kind, "the action again");
    require(std::fabs(again[i].command.value - script[i].command.value) < 1e-12, "the value again");
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::vector<OperatorAction> script;
  try {
    script = parse_operator_script(fuzz::text_of(data, size), kFile);
  } catch (const ProgramError& error) {
    fuzz::require_place(error.what(), kFile);
    return 0;
  }
  judge(script);
  return 0;
}
