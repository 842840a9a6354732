#include "app/cli/completions.h"

#include <map>
#include <string_view>

#include "app/cli/help_formatter.h"
#include "app/cli/named_files.h"
#include "app/cli/unknown_word.h"

namespace trn {

namespace {

constexpr const char kBash[] = R"sh(# bash completion of trunnion; 'trunnion completions bash' wrote it.
_trunnion_files() {
  local name every=()
  while IFS= read -r name; do
    every+=("$name")
    if [ -z "$2" ] || [ -d "$name" ] || [ "${name##*.}" = "$2" ]; then COMPREPLY+=("$name"); fi
  done < <(compgen -f -- "$1")
  [ ${#COMPREPLY[@]} -gt 0 ] || COMPREPLY=("${every[@]}")
  compopt -o filenames 2>/dev/null
}

_trunnion() {
  local word meaning current=${COMP_WORDS[COMP_CWORD]}
  [ "$current" != = ] || current=
  COMPREPLY=()
  while IFS=$'\t' read -r word meaning; do
    case $word in
      :files*) _trunnion_files "$current" "${word#:files}" ;;
      *) COMPREPLY+=("$word") ;;
    esac
  done < <("${COMP_WORDS[0]/#\~/$HOME}" complete "${COMP_WORDS[@]:1:COMP_CWORD}" 2>/dev/null)
}

complete -F _trunnion trunnion
)sh";

constexpr const char kZsh[] = R"sh(#compdef trunnion
# zsh completion of trunnion; 'trunnion completions zsh' wrote it.
_trunnion() {
  local line kind
  local -a found
  for line in "${(@f)$(${~words[1]} complete "${(@)words[2,CURRENT]}" 2>/dev/null)}"; do
    case $line in
      :files) _files ;;
      :files*) kind=${line#:files}; _files -g "*.$kind(-.)" || _files ;;
      ?*) found+=("${${line%%$'\t'*}//:/\\:}:${line#*$'\t'}") ;;
    esac
  done
  [[ ${#found} -eq 0 ]] || _describe -o trunnion found
}
if [ "$funcstack[1]" = _trunnion ]; then _trunnion "$@"; else compdef _trunnion trunnion; fi
)sh";

constexpr const char kFish[] = R"sh(# fish completion of trunnion; 'trunnion completions fish' wrote it.
function __trunnion_complete
    set -l words (commandline -opc) (commandline -ct)
    for line in (eval $words[1] complete (string escape -- $words[2..-1]) 2>/dev/null)
        switch $line
            case ':files'
                __fish_complete_path (commandline -ct)
            case ':files*'
                __fish_complete_suffix .(string replace ':files' '' -- $line)
            case '*'
                echo $line
        end
    end
end
complete -c trunnion -f -a '(__trunnion_complete)'
)sh";

/// "kind" of a value that is the name of a file; other values of that type may be any file.
const std::map<std::string_view, std::string_view> kEndings = {
    {"--machine", "toml"}, {"--tools", "tbl"}, {"--vars", "var"}, {"program", "ngc"}, {"trace", "csv"}};

std::string offer(std::string_view word, std::string_view meaning) {
  return std::string(word) + "\t" + std::string(meaning.substr(0, meaning.find_first_of("\n\t"))) + "\n";
}

bool begins(std::string_view word, const std::string& with) { return word.substr(0, with.size()) == with; }

std::string values_of(const CLI::Option& option, const std::string& begun) {
  const std::vector<std::string> choices = choices_of(option);
  std::string out;
  for (const std::string& choice : choices)
    if (begins(choice, begun)) out += offer(choice, option_text(option));
  const bool text = option.get_type_name().rfind("TEXT", 0) == 0;
  if (!choices.empty() || !text) return out;
  const std::string name = option.get_positional() ? CLI::detail::to_lower(option.get_name(true, false))
                                                   : "--" + option.get_lnames().at(0);
  if (name == "--machine")
    for (const std::string& machine : machine_names())
      if (begins(machine, begun)) out += offer(machine, "a machine by its name");
  const auto ending = kEndings.find(name);
  return out + ":files" + (ending == kEndings.end() ? "" : std::string(ending->second)) + "\n";
}

const CLI::Option* find_option(const CLI::App& app, const std::string& word) {
  return app.get_option_no_throw(word.substr(0, word.find('=')));
}

/// Where the words before the last one have led.
struct Place {
  const CLI::App* app;
  const CLI::Option* waits = nullptr;  ///< an option whose value comes next
  std::size_t arguments = 0;           ///< that have been given
  bool help = false;                   ///< behind 'help', where a command's name comes

  void pass(const std::string& word) {
    if (word == "=") return;  // bash gives it as a word of its own
    if (waits) {
      waits = nullptr;
    } else if (word.size() > 1 && word[0] == '-') {
      const CLI::Option* option = find_option(*app, word);
      if (option && takes_value(*option) && word.find('=') == std::string::npos) waits = option;
    } else if (const CLI::App* command = find_command(*app, {word})) {
      app = command;
      arguments = 0;
    } else if (!app->get_parent() && word == "help") {
      help = true;
    } else {
      ++arguments;
    }
  }
};

std::string options_of(const CLI::App& app, const std::string& begun) {
  std::string out;
  for (const CLI::Option* option : shown_options(app, false))
    for (const std::string& name : option->get_lnames())
      if (begins("--" + name, begun)) out += offer("--" + name, option_text(*option));
  return out;
}

std::string commands_of(const CLI::App& app, const std::string& begun) {
  std::string out;
  for (const CLI::App* command : shown_commands(app))
    if (begins(command->get_name(), begun)) out += offer(command->get_name(), first_sentence(*command));
  return out;
}

std::string argument_of(const CLI::App& app, std::size_t index, const std::string& begun) {
  const std::vector<const CLI::Option*> arguments = shown_options(app, true);
  if (arguments.empty()) return "";
  const CLI::Option& last = *arguments.back();
  const bool many = last.get_expected_max() >= CLI::detail::expected_max_vector_size;
  if (index < arguments.size()) return values_of(*arguments[index], begun);
  return many ? values_of(last, begun) : "";
}

}  // namespace

std::string complete_word(const CLI::App& app, const std::vector<std::string>& words) {
  Place place{&app};
  for (std::size_t i = 0; i + 1 < words.size(); ++i) place.pass(words[i]);
  const std::string begun = words.empty() || words.back() == "=" ? "" : words.back();
  if (place.waits) return values_of(*place.waits, begun);
  if (begun.starts_with("-")) return options_of(*place.app, begun);
  std::string out = commands_of(*place.app, begun);
  if (!place.app->get_parent() && !place.help && begins("help", begun))
    out += offer("help", "Explain a command, a code, a fault or a key");
  return out + argument_of(*place.app, place.arguments, begun);
}

std::string completion_script(const std::string& shell) {
  const std::map<std::string_view, const char*> scripts = {{"bash", kBash}, {"zsh", kZsh}, {"fish", kFish}};
  const auto found = scripts.find(shell);
  return found == scripts.end() ? "" : found->second;
}

}  // namespace trn
