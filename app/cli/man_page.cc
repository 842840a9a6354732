#include "app/cli/man_page.h"

#include <fmt/format.h>

#include <string_view>

#include "app/cli/help_formatter.h"
#include "core/letter_case.h"

namespace trn {

namespace {

/// Text as roff takes it literally, a line an input line.
std::string roff(std::string_view text) {
  std::string out;
  bool starts = true;
  for (const char c : text) {
    if (starts && (c == '.' || c == '\'')) out += "\\&";
    starts = c == '\n';
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else
      out += c;
  }
  return out;
}

/// "trunnion can sdo", with another word between for the name of a page.
std::string full_name(const CLI::App& app, const char* between) {
  return app.get_parent() ? full_name(*app.get_parent(), between) + between + app.get_name() : app.get_name();
}

std::string option_head(const CLI::Option& option) {
  const bool positional = option.get_positional();
  const std::string head = fmt::format("\\fB{}\\fR", roff(option.get_name(positional, !positional)));
  const std::string value = positional ? "" : value_name(option);
  return value.empty() ? head : fmt::format("{} \\fI{}\\fR", head, roff(value));
}

std::string options_text(const CLI::App& app, bool positional) {
  std::string out;
  for (const CLI::Option* option : shown_options(app, positional))
    out += fmt::format(".TP\n{}\n{}\n", option_head(*option),
                       roff(option_text(*option) + option_remarks(*option)));
  return out;
}

std::string synopsis(const CLI::App& app) {
  std::string out = fmt::format("\\fB{}\\fR [\\fIoptions\\fR]", roff(full_name(app, " ")));
  for (const CLI::Option* option : shown_options(app, true)) {
    const std::string name = fmt::format("\\fI{}\\fR", roff(option->get_name(true, false)));
    const char* more = option->get_expected_max() >= CLI::detail::expected_max_vector_size ? "..." : "";
    out += fmt::format(fmt::runtime(option->get_required() ? " {}{}" : " [{}{}]"), name, more);
  }
  if (!shown_commands(app).empty()) out += " \\fIcommand\\fR";
  return out + "\n";
}

std::string section(const char* name, const std::string& text) {
  return text.empty() ? "" : fmt::format(".SH {}\n{}", name, text);
}

/// As it stands, for text that is in lines already.
std::string literal(const std::string& text) {
  return text.empty() ? ""
                      : fmt::format(".nf\n{}\n.fi\n", roff(text.substr(0, text.find_last_not_of('\n') + 1)));
}

/// The program's commands, each with a page of its own.
std::string list_of_pages(const CLI::App& app) {
  std::string out, group;
  for (const CLI::App* command : shown_commands(app)) {
    if (command->get_group() != group) out += fmt::format(".SS {}\n", roff(group = command->get_group()));
    out += fmt::format(".TP\n\\fB{}\\fR(1)\n{}.\n", roff(full_name(*command, "-")),
                       roff(first_sentence(*command)));
  }
  return out;
}

/// The commands of a command, with all that there is about them.
std::string commands_in_full(const CLI::App& app) {
  std::string out;
  for (const CLI::App* command : shown_commands(app))
    out += fmt::format(".SS {}\n{}.PP\n{}\n{}{}{}", roff(full_name(*command, " ")), synopsis(*command),
                       roff(full_text(*command)), options_text(*command, true), options_text(*command, false),
                       literal(command->get_footer()));
  return out;
}

constexpr const char kEnds[] =
    ".TP\n0\ndone\n.TP\n2\nthe program, or what was measured, is wrong\n.TP\n3\nthe machine's config is "
    "wrong\n"
    ".TP\n4\na fault of the machine, or a limit or tolerance broken\n.TP\n5\nthe command line is wrong\n";

}  // namespace

std::string man_page(const CLI::App& app) {
  const CLI::App* const program = app.get_parent();
  const std::string name = full_name(app, "-");
  std::string out =
      fmt::format(".TH {} 1 \"\" \"Trunnion {}\" \"Trunnion\"\n", roff(upper_case(name)), TRN_VERSION);
  out += fmt::format(".SH NAME\n{} \\- {}\n", roff(name), roff(first_sentence(app)));
  out += section("SYNOPSIS", synopsis(app));
  out += section("DESCRIPTION", program ? roff(full_text(app)) + "\n" : literal(full_text(app)));
  out += section("ARGUMENTS", options_text(app, true));
  out += section("OPTIONS", options_text(app, false));
  out += section("COMMANDS", program ? commands_in_full(app) : list_of_pages(app));
  out += section("NOTES", literal(app.get_footer()));
  out += section("EXIT STATUS", kEnds);
  if (program) out += section("SEE ALSO", fmt::format("\\fB{}\\fR(1)\n", program->get_name()));
  return out;
}

}  // namespace trn
