#include "app/import/hal_setup.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "core/config.h"
#include "core/letter_case.h"

namespace trn {

namespace {

constexpr int kSourceDepthMax = 8;

/// A command of HAL: its least number of words behind it, and what would be right.
struct HalCommand {
  const char* name;
  std::size_t words_min;
  const char* form;
};

constexpr HalCommand kHalCommands[] = {
    {"loadrt", 1, "loadrt MODULE [KEY=VALUE ...]"},
    {"loadusr", 1, "loadusr [-W] PROGRAM [ARGUMENTS]"},
    {"waitusr", 1, "waitusr PROGRAM"},
    {"addf", 2, "addf FUNCTION THREAD"},
    {"delf", 1, "delf FUNCTION THREAD"},
    {"net", 1, "net SIGNAL PIN ..."},
    {"linkps", 2, "linkps PIN SIGNAL"},
    {"linksp", 2, "linksp SIGNAL PIN"},
    {"linkpp", 2, "linkpp PIN PIN"},
    {"unlinkp", 1, "unlinkp PIN"},
    {"newsig", 2, "newsig SIGNAL TYPE"},
    {"delsig", 1, "delsig SIGNAL"},
    {"setp", 2, "setp PIN VALUE"},
    {"sets", 2, "sets SIGNAL VALUE"},
    {"source", 1, "source FILE"},
    {"alias", 3, "alias pin PIN NAME"},
    {"unalias", 2, "unalias pin NAME"},
    {"start", 0, "start"},
    {"stop", 0, "stop"},
    {"show", 0, "show"},
    {"list", 0, "list TYPE"},
    {"status", 0, "status"},
    {"save", 0, "save"},
    {"print", 0, "print"},
    {"echo", 0, "echo"},
    {"unecho", 0, "unecho"},
    {"debug", 0, "debug LEVEL"},
    {"lock", 0, "lock"},
    {"unlock", 0, "unlock"},
    {"getp", 1, "getp PIN"},
    {"gets", 1, "gets SIGNAL"},
    {"ptype", 1, "ptype PIN"},
    {"stype", 1, "stype SIGNAL"},
    {"log", 0, "log"},
    {"help", 0, "help"},
    {"unload", 1, "unload MODULE"},
    {"unloadrt", 1, "unloadrt MODULE"},
    {"unloadusr", 1, "unloadusr PROGRAM"},
    {"quit", 0, "quit"},
    {"exit", 0, "exit"},
};

const HalCommand* find_hal_command(const std::string& name) {
  for (const HalCommand& command : kHalCommands)
    if (name == command.name) return &command;
  return nullptr;
}

// Words of a line, up to a comment; a quoted word may have blanks in it.
std::vector<HalWord> split_hal_line(const JoinedLine& line, const std::string& file) {
  std::vector<HalWord> words;
  const std::string& text = line.text;
  for (std::size_t at = 0; at < text.size();) {
    if (std::isspace(static_cast<unsigned char>(text[at]))) {
      ++at;
      continue;
    }
    if (text[at] == '#') break;
    const ImportPlace place{file, line.line, static_cast<int>(at) + 1};
    std::string word;
    while (at < text.size() && !std::isspace(static_cast<unsigned char>(text[at]))) {
      if (text[at] != '"' && text[at] != '\'') {
        word += text[at++];
        continue;
      }
      const std::size_t end = text.find(text[at], at + 1);
      if (end == std::string::npos)
        throw ImportError({file, line.line, static_cast<int>(at) + 1}, "this quotation mark is never closed");
      word += text.substr(at + 1, end - at - 1);
      at = end + 1;
    }
    words.push_back({word, place});
  }
  return words;
}

bool is_key_letter(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-'; }

/// A reference [SECTION]KEY or [SECTION](KEY) at `at`; `end` is behind it. No end: it is none.
struct IniReference {
  std::string section = {}, key = {};
  std::size_t end = 0;
};

IniReference reference_at(const std::string& text, std::size_t at) {
  const std::size_t close = text.find(']', at);
  if (close == std::string::npos || close + 1 >= text.size()) return {};
  IniReference out{text.substr(at + 1, close - at - 1)};
  std::size_t end = close + 1;
  if (text[end] == '(') {
    const std::size_t bracket = text.find(')', end);
    if (bracket == std::string::npos) return {};
    out.key = text.substr(end + 1, bracket - end - 1);
    out.end = bracket + 1;
    return out;
  }
  while (end < text.size() && is_key_letter(text[end])) ++end;
  out.key = text.substr(close + 1, end - close - 1);
  out.end = end;
  return out;
}

std::string pin_module(std::string_view pin) { return std::string(pin.substr(0, pin.find('.'))); }

}  // namespace

struct HalSetup::Context {
  const IniFile& ini;
  const ImportReader& read;
  const std::string& library;
  std::vector<ImportGap>& gaps;

  // INI values for their names; a value of several words becomes several.
  std::vector<HalWord> substituted(const std::vector<HalWord>& words) const {
    std::vector<HalWord> out;
    for (const HalWord& word : words) {
      const std::string text = with_values(word);
      std::size_t at = 0;
      if (text == word.text) {
        out.push_back(word);
        continue;
      }
      while (at < text.size()) {
        const std::size_t end = std::min(text.find_first_of(" \t", at), text.size());
        if (end > at) out.push_back({text.substr(at, end - at), word.place});
        at = end + 1;
      }
    }
    return out;
  }

  std::string with_values(const HalWord& word) const {
    std::string out;
    for (std::size_t at = 0; at < word.text.size();) {
      const IniReference reference = word.text[at] == '[' ? reference_at(word.text, at) : IniReference{};
      if (reference.end == 0) {
        out += word.text[at++];
        continue;
      }
      const IniEntry* entry = ini.find(reference.section, reference.key);
      if (entry)
        out += entry->value;
      else
        gaps.push_back({word.place, fmt::format("[{}]{}", reference.section, reference.key),
                        "the INI has no such key, so this line of HAL has no value"});
      at = reference.end;
    }
    return out;
  }
};

HalSetup HalSetup::load(const IniFile& ini, const ImportReader& read, const std::string& library) {
  HalSetup setup;
  Context context{ini, read, library, setup.gaps_};
  for (const char* key : {"HALFILE", "HALCMD", "POSTGUI_HALFILE", "POSTGUI_HALCMD"})
    for (const IniEntry* entry : ini.all("HAL", key)) {
      if (std::string_view(key).ends_with("HALFILE"))
        setup.read_named(context, *entry);
      else  // blanks keep its columns
        setup.read_text(context, std::string(entry->value_place.column - 1, ' ') + entry->value,
                        entry->value_place.file, entry->value_place.line, 0);
    }
  return setup;
}

void HalSetup::read_named(Context& context, const IniEntry& entry) {
  const std::string name(trimmed(entry.value).substr(0, trimmed(entry.value).find_first_of(" \t")));
  const bool of_library = name.starts_with("LIB:");
  const std::string bare = of_library ? name.substr(4) : name;
  if (lower_case(bare).ends_with(".tcl")) {
    gaps_.push_back(
        {entry.value_place, name,
         "a HAL file in Tcl is a program and is not read: what it sets and connects is not known"});
    return;
  }
  if (!of_library) {
    const std::string path = beside(folder_of(context.ini.path()), bare);
    if (context.read(path)) return read_file(context, name, path, entry.value_place, 0);
  }
  read_file(context, name, beside(context.library, bare), entry.value_place, 0);
}

void HalSetup::read_file(Context& context, const std::string& name, const std::string& path,
                         ImportPlace named_at, int depth) {
  const std::optional<std::string> text = context.read(path);
  if (!text) {
    gaps_.push_back({named_at, name, "this HAL file cannot be read: what it sets and connects is not known"});
    return;
  }
  files_.push_back(path);
  read_text(context, *text, path, 1, depth);
}

void HalSetup::read_text(Context& context, std::string_view text, const std::string& file, int first_line,
                         int depth) {
  for (JoinedLine& line : joined_lines(text, file)) {
    line.line += first_line - 1;
    const std::vector<HalWord> words = split_hal_line(line, file);
    if (words.empty()) continue;
    const HalCommand* command = find_hal_command(words[0].text);
    if (command && words.size() - 1 < command->words_min)
      throw ImportError(words[0].place, fmt::format("words are missing behind '{}'; '{}' would be right",
                                                    words[0].text, command->form));
    obey(context, context.substituted(words), depth);
  }
}

void HalSetup::obey(Context& context, const std::vector<HalWord>& words, int depth) {
  if (words.empty()) return;
  const std::string& name = words[0].text;
  const HalCommand* command = find_hal_command(name);
  if (!command) {
    if (name.find('=') != std::string::npos || (words.size() > 1 && words[1].text.starts_with('=')))
      return set_pin(words, true);
    std::vector<std::string> legal;
    for (const HalCommand& one : kHalCommands) legal.emplace_back(one.name);
    const std::string near = nearest_word(name, legal);
    throw ImportError(words[0].place, fmt::format("'{}' is no command of HAL{}", name.substr(0, 40),
                                                  near.empty() ? "; setp, net, loadrt and addf are"
                                                               : fmt::format("; did you mean '{}'?", near)));
  }
  if (words.size() - 1 < command->words_min) return;  // what the INI does not have is told already
  if (name == "loadrt" || name == "loadusr") return load_module(words);
  if (name == "setp") return set_pin(words, false);
  if (name == "addf") ++functions_;
  if (name == "source") {
    if (depth >= kSourceDepthMax)
      throw ImportError(words[1].place, "files that source each other more than 8 deep go round in a circle");
    const std::string path = beside(folder_of(context.ini.path()), words[1].text);
    return read_file(context, words[1].text, path, words[1].place, depth + 1);
  }
  obey_signal(words);
}

void HalSetup::obey_signal(const std::vector<HalWord>& words) {
  const std::string& name = words[0].text;
  if (name == "sets") signals_set_[words[1].text] = words[2];
  if (name == "unlinkp") signal_of_pin_.erase(words[1].text);
  if (name != "net" && name != "linksp" && name != "linkps") return;
  const bool pin_first = name == "linkps";
  HalSignal& target = signal(pin_first ? words.back() : words[1]);
  for (std::size_t i = pin_first ? 1 : 2; i < words.size() - (pin_first ? 1 : 0); ++i) {
    const std::string& pin = words[i].text;
    if (pin == "=>" || pin == "<=" || pin == "<=>") continue;
    target.pins.push_back(words[i]);
    signal_of_pin_[pin] = signal_at_.at(target.name);
  }
}

HalSignal& HalSetup::signal(const HalWord& name) {
  const auto [found, fresh] = signal_at_.emplace(name.text, signals_.size());
  if (fresh) signals_.push_back({name.text, name.place});
  return signals_[found->second];
}

void HalSetup::set_pin(const std::vector<HalWord>& words, bool short_form) {
  if (!short_form) {
    pins_set_[words[1].text] = words[2];
    return;
  }
  std::string all;
  for (const HalWord& word : words) all += word.text;
  const std::size_t equals = all.find('=');
  if (equals == 0 || equals + 1 >= all.size())
    throw ImportError(words[0].place, "a pin is set by 'setp PIN VALUE', or 'PIN = VALUE'");
  pins_set_[all.substr(0, equals)] = {all.substr(equals + 1), words.back().place};
}

void HalSetup::load_module(const std::vector<HalWord>& words) {
  std::size_t first = 1;
  // The options of loadusr stand before the program; -Wn takes a name.
  while (words[0].text == "loadusr" && first + 1 < words.size() && words[first].text.starts_with('-'))
    first += words[first].text.ends_with('n') && first + 2 < words.size() ? 2 : 1;
  HalModule module{words[first].text, {}, words[0].place, words[0].text == "loadrt"};
  module.arguments.assign(words.begin() + static_cast<std::ptrdiff_t>(first) + 1, words.end());
  modules_.push_back(module);
}

std::optional<HalValue> HalSetup::value_of(const std::string& pin) const {
  if (const auto at = signal_of_pin_.find(pin); at != signal_of_pin_.end()) {
    const HalSignal& found = signals_[at->second];
    if (const auto value = signals_set_.find(found.name); value != signals_set_.end())
      return HalValue{value->second.text, value->second.place};
    for (const HalWord& other : found.pins)
      if (pin_module(other.text) != pin_module(pin)) return HalValue{"", found.place, other.text};
  }
  const auto set = pins_set_.find(pin);
  if (set == pins_set_.end()) return std::nullopt;
  return HalValue{set->second.text, set->second.place};
}

std::vector<const HalSignal*> HalSetup::signals_of(std::string_view prefix) const {
  std::vector<const HalSignal*> out;
  for (const HalSignal& one : signals_)
    if (std::any_of(one.pins.begin(), one.pins.end(),
                    [&](const HalWord& pin) { return pin.text.starts_with(prefix); }))
      out.push_back(&one);
  return out;
}

bool HalSetup::has_module(std::string_view name) const {
  return std::any_of(modules_.begin(), modules_.end(), [&](const HalModule& m) { return m.name == name; });
}

}  // namespace trn
