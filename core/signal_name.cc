#include "core/signal_name.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>
#include <optional>

namespace trn {

namespace {

constexpr int kIoNumbers = 64, kDriveBits = 32;
const std::vector<std::string> kStates = {"enabled", "moving",  "running", "fault",
                                          "homed",   "spindle", "mist",    "flood"};  // as MachineSignal
constexpr std::string_view kLegal =
    "\"io.input.3\", \"io.output.3\", \"drive.X.input.16\" and \"drive.X.output.0\" are legal, X being a "
    "joint";

std::vector<std::string> split(std::string_view text) {
  std::vector<std::string> out(1);
  for (const char c : text)
    if (c == '.')
      out.emplace_back();
    else
      out.back() += c;
  return out;
}

std::optional<int> number_below(const std::string& text, int limit) {
  int value = -1;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || value < 0 || value >= limit) return {};
  return value;
}

}  // namespace

std::string to_string(const SignalName& name, const Machine& machine) {
  if (name.kind == SignalName::Kind::kMachine)
    return "machine." + kStates[static_cast<std::size_t>(name.number)];
  const char* way = name.is_input() ? "input" : "output";
  if (!name.of_drive()) return fmt::format("io.{}.{}", way, name.number);
  return fmt::format("drive.{}.{}.{}", machine.joints[static_cast<std::size_t>(name.joint)].name, way,
                     name.number);
}

SignalName read_signal_name(const Machine& machine, const ConfigTable& table, std::string_view key) {
  const std::string text = table.text(key);
  const auto refuse = [&](const std::string& why) {
    return table.error(key, fmt::format("'{}' is no signal: {}; {}", text, why, kLegal));
  };
  const std::vector<std::string> words = split(text);
  if (words[0] == "machine" && words.size() == 2) {
    const auto found = std::find(kStates.begin(), kStates.end(), words[1]);
    if (found == kStates.end())
      throw table.error(
          key, fmt::format("'{}' is no state of the machine; legal: {}", words[1], fmt::join(kStates, ", ")));
    return {SignalName::Kind::kMachine, -1, static_cast<int>(found - kStates.begin())};
  }
  const bool io = words[0] == "io" && words.size() == 3, drive = words[0] == "drive" && words.size() == 4;
  if (!io && !drive) throw refuse("it has another form");
  SignalName name;
  const std::string& way = words[words.size() - 2];
  if (way != "input" && way != "output") throw refuse(fmt::format("'{}' is neither input nor output", way));
  const auto number = number_below(words.back(), io ? kIoNumbers : kDriveBits);
  if (!number) throw refuse(fmt::format("the number must be 0 to {}", (io ? kIoNumbers : kDriveBits) - 1));
  name.number = *number;
  using K = SignalName::Kind;
  name.kind = way == "input" ? (io ? K::kIoInput : K::kDriveInput) : (io ? K::kIoOutput : K::kDriveOutput);
  if (io) return name;
  for (std::size_t i = 0; i < machine.joints.size(); ++i)
    if (machine.joints[i].name == words[1]) name.joint = static_cast<int>(i);
  if (name.joint < 0) throw refuse(fmt::format("there is no joint '{}'", words[1]));
  return name;
}

}  // namespace trn
