#include "app/cli/meant_command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <filesystem>
#include <iterator>
#include <string_view>

#include "app/cli/named_files.h"
#include "app/cli/topics.h"
#include "core/letter_case.h"

namespace trn {

namespace {

struct OtherWord {
  std::string_view words;  ///< separated by blanks
  std::string_view meant;
};

// Words of other controls and senders, and of people, for what has another name here.
constexpr auto kOtherWords = std::to_array<OtherWord>({
    {"check verify validate lint parse dry-run dryrun",
     "'trunnion interpret PROGRAM' tells all errors of a program"},
    {"simulate sim simulation preview execute plan",
     "'trunnion run PROGRAM' runs a program on simulated drives"},
    {"open send upload file program",
     "'trunnion load PROGRAM' gives the daemon a program, and 'trunnion start' begins it"},
    {"go begin cycle-start cycle_start cyclestart play",
     "'trunnion start' begins the program that is loaded"},
    {"pause feedhold feed-hold feed_hold", "'trunnion hold' brakes on the path"},
    {"continue cont unpause", "'trunnion resume' goes on"},
    {"cancel abort halt kill break",
     "'trunnion stop' ends the program on its path, 'trunnion estop' at once"},
    {"emergency emergency-stop panic", "'trunnion estop' brakes every drive and takes its power"},
    {"unlock enable power on machine-on machine_on init clear", "'trunnion reset' brings the drives up"},
    {"reference ref homing", "'trunnion home' homes the machine"},
    {"move goto rapid g-code gcode line",
     "'trunnion mdi \"G0 X10\"' runs a line of G-code, and 'trunnion jog X 10' moves one axis"},
    {"spindle coolant probe m3 m5", "'trunnion mdi \"M3 S1000\"' runs a line of G-code"},
    {"zero set-zero setzero touchoff touch wcs workoffset", "'trunnion touch-off X 0' makes this place X0"},
    {"offsets g54 work-offset", "'trunnion offset' shows the work offsets"},
    {"tool-table tooltable tool_table", "'trunnion tool' shows the tools"},
    {"feed speed feedrate feed-override rate", "'trunnion override 80' sets the speed in percent"},
    {"single singleblock single-block single_block", "'trunnion step on' stops at the end of every line"},
    {"watch dro position positions pos where display show top",
     "'trunnion monitor' follows the machine, and 'trunnion status' shows it once"},
    {"state info ping", "'trunnion status' shows the state of machine and daemon"},
    {"ack alarm alarms", "'trunnion status' shows the alarms, and 'trunnion acknowledge' takes one away"},
    {"mpg handwheel pendant", "'trunnion wheel' turns axes by the counts of a hand wheel"},
    {"serve server service", "'trunnion daemon --machine mill' drives a machine"},
    {"gui ui web page dashboard", "'trunnion panel' serves the operator's page"},
    {"quit exit shutdown shut-down off",
     "the daemon ends with Ctrl-C where it runs, or with 'systemctl stop trunnion@mill'"},
    {"new setup wizard", "'trunnion commission' goes through the first day of a machine"},
    {"linuxcnc convert migrate",
     "'trunnion import linuxcnc MACHINE.ini' makes a config of another control's"},
    {"explain manual docs", "'trunnion help COMMAND' explains a command, a code, a fault or a key"},
    {"keys schema", "'trunnion config --keys' tells what a config may say"},
    {"halscope oscilloscope record trace plot", "'trunnion scope' records any signal at every period"},
    {"autotune pid servo", "'trunnion tune' measures a joint, and finds its feed-forward and jerk"},
    {"sdo pdo nodes canopen", "'trunnion can' looks at the nodes of a CANopen bus"},
    {"license licence about version", "'trunnion --version' tells version and commit"},
});

bool holds(std::string_view list, std::string_view word) {
  while (!list.empty()) {
    const std::size_t end = std::min(list.find(' '), list.size());
    if (list.substr(0, end) == word) return true;
    list.remove_prefix(std::min(end + 1, list.size()));
  }
  return false;
}

std::string meant_file(const std::string& word) {
  const std::string ending = lower_case(std::filesystem::path(word).extension().string());
  if (ending == ".toml")
    return fmt::format(
        "'trunnion daemon --machine {0}' drives this machine, and 'trunnion config --check {0}' "
        "reads the config",
        word);
  if (ending == ".ini") return fmt::format("'trunnion import linuxcnc {}' makes a config of it", word);
  if (ending == ".eds" || ending == ".dcf") return "'trunnion can' looks at the nodes of a CANopen bus";
  const std::string program = with_examples(word);
  static constexpr std::string_view kEndings[] = {".ngc", ".nc", ".cnc", ".tap", ".gcode"};
  const bool named = std::find(std::begin(kEndings), std::end(kEndings), ending) != std::end(kEndings);
  if (!is_file(program))
    return named ? "'trunnion run PROGRAM' runs a program, but there is no file of this name" : "";
  return fmt::format(
      "'trunnion run {0}' runs this program on simulated drives, and 'trunnion load {0}' gives it "
      "to the daemon",
      word);
}

}  // namespace

bool is_gcode(const std::string& word) {
  static constexpr std::string_view kLetters = "abcdfghmstxyz";
  const std::size_t sign = word.size() > 1 && (word[1] == '-' || word[1] == '.') ? 2 : 1;
  return word.size() > sign && kLetters.find(lower_case(word[0])) != std::string_view::npos &&
         std::isdigit(static_cast<unsigned char>(word[sign]));
}

std::string meant_command(const std::vector<std::string>& words) {
  const std::string& word = words.front();
  if (const std::string file = meant_file(word); !file.empty()) return file;
  const std::string small = lower_case(word);
  const auto other = std::find_if(kOtherWords.begin(), kOtherWords.end(),
                                  [&](const OtherWord& row) { return holds(row.words, small); });
  if (other != kOtherWords.end()) return std::string(other->meant);
  if (!is_gcode(word)) return "";
  const std::string line = fmt::format("'trunnion mdi \"{}\"' runs a line of G-code", fmt::join(words, " "));
  return topic_text(word).empty() ? line
                                  : fmt::format("{}, and 'trunnion help {}' explains the code", line, word);
}

}  // namespace trn
