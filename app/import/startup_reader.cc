#include "app/import/startup_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/import/import_place.h"
#include "core/letter_case.h"

namespace trn {

namespace {

constexpr double kMmPerInch = 25.4;

bool is_inch(double unit) { return std::abs(unit - kMmPerInch) < 1e-6; }

/// A word of the start code; without a number if its value is an expression.
struct StartWord {
  char letter = 0;
  std::string text = {};
  std::optional<double> number = {};
  bool is_g(double code) const { return letter == 'G' && number && std::abs(*number - code) < 1e-6; }
};

std::string without_comments(const std::string& line) {
  std::string out;
  bool inside = false;
  for (const char c : line) {
    if (c == ';' && !inside) break;
    if (c == '(') inside = true;
    if (!inside && !std::isspace(static_cast<unsigned char>(c))) out += upper_case(c);
    if (c == ')') inside = false;
  }
  return out;
}

/// Where the value that begins at `at` ends: a number, or an expression with brackets or parameters.
std::size_t value_end(const std::string& code, std::size_t at) {
  int open = 0;
  for (; at < code.size(); ++at) {
    const char c = code[at];
    if (c == '[' || c == '<') ++open;
    if (c == ']' || c == '>') --open;
    if (open == 0 && c >= 'A' && c <= 'Z') break;
  }
  return at;
}

std::vector<StartWord> start_words(const std::string& line) {
  const std::string code = without_comments(line);
  std::vector<StartWord> words;
  for (std::size_t at = 0; at < code.size();) {
    const std::size_t end = value_end(code, at + 1);
    const std::string value = code.substr(at + 1, end - at - 1);
    words.push_back({code[at], code.substr(at, end - at), whole_number_text(value)});
    at = end;
  }
  return words;
}

const StartWord* find_g(const std::vector<StartWord>& words, double code) {
  const auto found =
      std::find_if(words.begin(), words.end(), [&](const StartWord& w) { return w.is_g(code); });
  return found == words.end() ? nullptr : &*found;
}

/// What a program may do without, since it is in force here as well.
bool is_in_force(const StartWord& word, double unit) {
  if (word.is_g(20)) return is_inch(unit);
  for (const double code : {8.0, 17.0, 21.0, 40.0, 49.0, 50.0, 54.0, 64.0, 61.0, 61.1, 69.0, 80.0, 90.0, 91.1,
                            92.1, 94.0, 97.0, 98.0})
    if (word.is_g(code)) return true;
  return false;
}

/// mm of the unit in which LinuxCNC starts a program.
double start_unit(const std::vector<StartWord>& words, const ImportedMachine& machine) {
  if (find_g(words, 20)) return kMmPerInch;
  return find_g(words, 21) ? 1 : machine.mm_per_unit;
}

std::string read_path_mode(const std::vector<StartWord>& words, double unit, ImportedMachine& machine) {
  if (find_g(words, 61.1)) return machine.path_mode = "G61.1";
  if (find_g(words, 61)) return machine.path_mode = "G61";
  if (!find_g(words, 64)) return "";
  const auto p = std::find_if(words.begin(), words.end(), [](const StartWord& w) { return w.letter == 'P'; });
  if (p == words.end()) return "";
  if (!p->number)
    return fmt::format("; {} is computed while LinuxCNC runs, and no tolerance was taken of it", p->text);
  if (!(*p->number > 0)) return fmt::format("; {} is no tolerance, and none was taken of it", p->text);
  machine.tolerance_mm = *p->number * unit;
  return fmt::format("G64 with {:.6g} mm", *machine.tolerance_mm);
}

void read_code(const IniEntry& entry, const std::vector<StartWord>& words, double unit,
               ImportedMachine& machine) {
  const std::string mode = read_path_mode(words, unit, machine);
  std::string rest;
  for (const StartWord& word : words) {
    const bool of_mode = word.letter == 'P' || word.letter == 'Q';
    if (!is_in_force(word, unit) && !(of_mode && machine.tolerance_mm))
      rest += (rest.empty() ? "" : " ") + word.text;
  }
  const bool taken = !mode.empty() && mode[0] != ';';
  machine.note(
      ImportSpot::kProgram, entry.key_place, entry.text(),
      fmt::format("no code is run at the start; {}{}{}",
                  taken ? mode + " was taken from it" : "nothing was taken from it", taken ? "" : mode,
                  rest.empty() ? "" : fmt::format("; not in force here: {}", rest)),
      rest.empty() ? (taken ? "nothing" : "tolerance_mm below, if G64 P was meant")
                   : "write these codes into the first lines of your programs, or into the post-processor");
}

/// First of all notes: a program that is read in another unit goes to other places. Programs begin here in mm
/// or in inches.
void note_unit(const IniFile& ini, double unit, ImportedMachine& machine) {
  if (std::abs(unit - 1) < 1e-9 || is_inch(unit)) return;
  const IniEntry* said_by = ini.find("TRAJ", "LINEAR_UNITS");
  ImportNote note;
  note.spot = ImportSpot::kMachine;
  note.place = said_by ? said_by->value_place : ini.place_of("TRAJ");
  note.what = said_by ? said_by->text() : "the unit of programs";
  note.why = fmt::format(
      "LinuxCNC starts programs and MDI in this unit, and here they start in mm (G21): without G20 or G21 in "
      "a "
      "program X1 and F1 mean 1 mm and 1 mm/min, and no longer {:.6g} mm and {:.6g} mm/min",
      unit, unit);
  note.to_do = "convert programs that have neither G20 nor G21";
  machine.notes.insert(machine.notes.begin(), std::move(note));
}

/// LinuxCNC takes these tolerances within bounds of its own alone, and keeps its usual one otherwise.
struct ArcTolerance {
  const char* key;
  double unit, least, most;
};

// One key here: what holds for programs in inches is 2.54 times as much, as it is by default in LinuxCNC.
constexpr ArcTolerance kArcMm = {"CENTER_ARC_RADIUS_TOLERANCE_MM", 1, 0.001, 0.02 * M_SQRT2};
constexpr ArcTolerance kArcInch = {"CENTER_ARC_RADIUS_TOLERANCE_INCH", kMmPerInch / 2.54, 0.00004,
                                   0.002 * M_SQRT2};

/// The value as arc_tolerance_mm would have it; nothing if there is none, or one that LinuxCNC does not take.
std::optional<double> arc_tolerance(const IniFile& ini, const ArcTolerance& one, ImportedMachine& machine) {
  const std::optional<double> value = ini.number("RS274NGC", one.key);
  if (!value) return std::nullopt;
  if (*value >= one.least && *value <= one.most * (1 + 1e-9)) return *value * one.unit;
  const IniEntry* entry = ini.find("RS274NGC", one.key);
  machine.note(
      ImportSpot::kProgram, entry->key_place, entry->text(),
      fmt::format("LinuxCNC takes {:.4g} to {:.4g}, and keeps its usual {:.4g} otherwise; so it is here",
                  one.least, one.most, one.most),
      fmt::format("arc_tolerance_mm = {:.6g}, if it was meant", *value * one.unit));
  return std::nullopt;
}

void read_arc_tolerance(const IniFile& ini, double unit, ImportedMachine& machine) {
  const bool inch = is_inch(unit);
  machine.arc_tolerance_mm = arc_tolerance(ini, inch ? kArcInch : kArcMm, machine);
  const ArcTolerance& other = inch ? kArcMm : kArcInch;
  const std::optional<double> mm = arc_tolerance(ini, other, machine);
  const double in_force = machine.arc_tolerance_mm.value_or(kArcMm.most);
  if (!mm || std::abs(*mm - in_force) < 1e-9) return;
  const IniEntry* entry = ini.find("RS274NGC", other.key);
  machine.note(
      ImportSpot::kProgram, entry->key_place, entry->text(),
      fmt::format("one key bounds both units here, and programs in inches have 2.54 times as much: what "
                  "holds for programs in {} was taken, {:.4g} mm",
                  inch ? "inches" : "mm", in_force),
      fmt::format("arc_tolerance_mm = {:.6g}, if the other unit matters more", *mm));
}

}  // namespace

void read_startup(const IniFile& ini, ImportedMachine& machine) {
  const IniEntry* entry = ini.find("RS274NGC", "RS274NGC_STARTUP_CODE");
  if (!entry) entry = ini.find("EMC", "RS274NGC_STARTUP_CODE");
  const std::vector<StartWord> words = entry ? start_words(entry->value) : std::vector<StartWord>();
  const double unit = start_unit(words, machine);
  if (entry) read_code(*entry, words, unit, machine);
  read_arc_tolerance(ini, unit, machine);
  machine.programs_in_inch = is_inch(unit);
  note_unit(ini, unit, machine);
}

}  // namespace trn
