#include "app/cli/panel_user.h"

#include <fmt/format.h>
#include <termios.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <iostream>
#include <memory>

#include "app/client/command_rights.h"
#include "panel/server/user_file.h"

namespace trn {

namespace {

struct UserOptions {
  std::string file = own_users_file(), name, role = "look";
};

/// What is typed is not seen while this lives.
class Unseen {
 public:
  Unseen() {
    tcgetattr(STDIN_FILENO, &before_);
    termios now = before_;
    now.c_lflag &= ~static_cast<tcflag_t>(ECHO);
    tcsetattr(STDIN_FILENO, TCSAFLUSH, &now);
  }
  ~Unseen() { tcsetattr(STDIN_FILENO, TCSAFLUSH, &before_); }
  Unseen(const Unseen&) = delete;
  Unseen& operator=(const Unseen&) = delete;

 private:
  termios before_{};
};

std::string typed(const std::string& question) {
  fmt::print(stderr, "{}: ", question);
  const Unseen unseen;
  std::string line;
  std::getline(std::cin, line);
  fmt::print(stderr, "\n");
  return line;
}

/// Asked for twice on a terminal; otherwise the first line of the standard input.
std::string ask_password(const std::string& name) {
  std::string first;
  if (!isatty(STDIN_FILENO)) {
    std::getline(std::cin, first);
    return first;
  }
  first = typed(fmt::format("Password for {}", name));
  if (typed("The same again") != first) throw UserError("these are two passwords; nothing was changed");
  return first;
}

void add_file(CLI::App& command, UserOptions& options) {
  command.add_option("--users", options.file, "File of the users, which nobody else can read")
      ->capture_default_str();
}

void add_add(CLI::App& user, const std::shared_ptr<UserOptions>& options) {
  CLI::App* add = user.add_subcommand("add", "Let somebody log in; asks for the password");
  add->add_option("name", options->name, "Letters, digits and . _ @ -")->required();
  add->add_option(
         "--role", options->role,
         "What he may do: look (and stop), operate, or \"set up\". Each may do what those before may")
      ->check(CLI::IsMember({"look", "operate", "set up"}))
      ->required();
  add_file(*add, *options);
  add->callback([options] {
    add_user(options->file, options->name, role_called(options->role).value(), ask_password(options->name));
    fmt::print("{} may {}.\n", options->name, options->role);
  });
}

void add_list(CLI::App& user, const std::shared_ptr<UserOptions>& options) {
  CLI::App* list = user.add_subcommand("list", "Print who may log in, and his role");
  add_file(*list, *options);
  list->callback([options] {
    for (const User& one : read_users(options->file)) fmt::print("{:20} {}\n", one.name, to_string(one.role));
  });
}

void add_remove(CLI::App& user, const std::shared_ptr<UserOptions>& options) {
  CLI::App* remove = user.add_subcommand("remove", "Let somebody log in no more, and end his sessions");
  remove->add_option("name", options->name, "As 'trunnion panel user list' prints it")->required();
  add_file(*remove, *options);
  remove->callback([options] { remove_user(options->file, options->name); });
}

}  // namespace

std::string own_users_file() {
  const char* state = std::getenv("STATE_DIRECTORY");
  const char* home = std::getenv("HOME");
  return state ? std::string(state) + "/users"
               : std::string(home ? home : "") + "/.local/state/trunnion/panel/users";
}

void add_panel_user(CLI::App& panel) {
  auto options = std::make_shared<UserOptions>();
  CLI::App* user = panel.add_subcommand("user", "Say who may log in to the page from other computers");
  user->require_subcommand(1);
  user->footer(
      "Example: trunnion panel user add anna --role operate\n"
      "A running panel takes a change up within a second.\n"
      "Exit codes: 0 done, 4 the file cannot be used or written, 5 usage.");
  add_add(*user, options);
  add_list(*user, options);
  add_remove(*user, options);
}

}  // namespace trn
