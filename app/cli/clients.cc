#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cctype>
#include <charconv>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/cli/client_session.h"
#include "app/cli/commands.h"
#include "app/cli/shown_state.h"
#include "app/client/command_client.h"
#include "app/client/daemon_line.h"
#include "app/client/message_json.h"
#include "app/daemon/telemetry.h"
#include "app/session/feature_report.h"
#include "core/axes.h"
#include "core/fault.h"
#include "core/machine.h"
#include "core/units.h"

namespace trn {

namespace {

using trunnion::acknowledge_t;
using trunnion::command_t;
using trunnion::motion_t;
using trunnion::status_t;
using Json = nlohmann::ordered_json;

command_t home_command(const Machine& machine, const ClientOptions& options) {
  command_t command = command_of(command_t::HOME);
  command.joint = options.text.empty() ? -1 : joint_index(machine, options.text);
  return command;
}

// The message, and what the fault table and the session's log know besides.
Json status_json(const status_t& status, const trunnion::alarms_t& alarms) {
  const FaultInfo* fault = find_fault(status.fault);
  Json out = json_of(status);
  out["fault_meaning"] = fault ? fault->meaning : "";
  out["fault_remedy"] = fault ? fault->remedy : "";
  out["features"] = features_json(features_of(status));
  out["alarms"] = Json::array();
  if (const Json listed = json_of(alarms); listed.contains("alarms")) out["alarms"] = listed["alarms"];
  return out;
}

// A daemon of another version may tell none; its state is told all the same.
trunnion::alarms_t alarms_of(ClientSession& session) {
  try {
    return session.client.alarms();
  } catch (const NoAnswer&) {
    return {};
  }
}

Exit show_status(const ClientOptions& options) {
  ClientSession session(options);
  const trunnion::alarms_t alarms = alarms_of(session);
  session.client.watch([&](const status_t& status, const motion_t& motion) {
    if (options.json)
      fmt::print("{}\n", one_line(status_json(status, alarms)));
    else
      fmt::print("{}{}", status_text(status, motion), alarms_text(alarms));
    return false;
  });
  session.compare_configs(options.timeout_s);
  return Exit::kDone;
}

int screen_columns() {
  winsize size{};
  return ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 0 ? size.ws_col : 80;
}

// From the top left, each line to its end and what is below them empty: nothing flickers.
void refresh_screen(const std::string& text) {
  std::string out = "\x1b[H";
  for (const char c : text) out += c == '\n' ? std::string("\x1b[K\n") : std::string(1, c);
  fmt::print("{}\x1b[J", out);
}

Exit monitor(const ClientOptions& options) {
  ClientSession session(options);
  const bool screen = !options.json && !options.lines && isatty(STDOUT_FILENO) == 1;
  if (screen) fmt::print("\x1b[2J");
  long shown = 0;
  session.client.watch([&](const status_t& status, const motion_t& motion) {
    if (options.json)
      fmt::print("{}\n", one_line(json_of(motion)));
    else if (screen)
      refresh_screen(screen_text(status, motion, screen_columns()));
    else
      fmt::print("{}", motion_line(status, motion));
    std::fflush(stdout);
    return ++shown != options.count;
  });
  return Exit::kDone;
}

/// A client that sends one command, made by `command` from config and options.
using MakeCommand = std::function<command_t(const Machine&, const ClientOptions&)>;

CLI::App& add_sender(CLI::App& app, Exit& exit, const std::shared_ptr<ClientOptions>& options,
                     const std::string& name, const std::string& help, MakeCommand command) {
  return add_client(app, exit, options, name, help, [command](const ClientOptions& chosen) {
    ClientSession session(chosen);
    return send(session, chosen, command(session.machine, chosen));
  });
}

Exit count_parts(const ClientOptions& options) {
  ClientSession session(options);
  if (options.count >= 0) {
    command_t command = command_of(command_t::PARTS);
    command.value = static_cast<double>(options.count);
    return send(session, options, command);
  }
  const auto any = [](const trunnion::status_t&) { return true; };
  if (const auto status = session.client.wait_status(any, options.timeout_s))
    fmt::print("{}\n", status->parts);
  return Exit::kDone;
}

MakeCommand plain(std::int8_t verb) {
  return [verb](const Machine&, const ClientOptions&) { return command_of(verb); };
}

// As the daemon's host knows it.
std::string program_path(const ClientOptions& options) {
  if (options.text.empty())
    throw CLI::ValidationError("program", "it has no name; give the file of a program, as part.ngc");
  const std::filesystem::path path = options.text;
  if (!options.remote.empty() && path.is_relative())
    throw CLI::ValidationError("program", "from another host, name the whole path on the daemon's");
  return std::filesystem::absolute(path).lexically_normal();
}

// A shell's quotes keep "\n" as two characters, and no G-code has a backslash.
std::string typed_lines(std::string text) {
  for (std::size_t at = 0; (at = text.find("\\n", at)) != std::string::npos;) text.replace(at, 2, "\n");
  return text;
}

// CLI11 would say of 1.5 that it is out of range.
std::function<std::string(const std::string&)> check_whole(long least) {
  return [least](const std::string& text) {
    constexpr long kMost = 1000000000;
    long value = 0;
    const char* const end = text.data() + text.size();
    const auto read = std::from_chars(text.data(), end, value);
    const bool whole = read.ec == std::errc() && read.ptr == end;
    if (whole && value >= least && value <= kMost) return std::string();
    return fmt::format("'{}' is {}; a whole number from {} to {} is legal", text,
                       whole ? "out of range" : "no whole number", least, kMost);
  };
}

void add_program_clients(CLI::App& app, Exit& exit) {
  auto load = std::make_shared<ClientOptions>();
  add_sender(app, exit, load, "load", "Give the daemon a program to prepare; nothing moves yet",
             [](const Machine&, const ClientOptions& options) {
               return text_command(command_t::LOAD, program_path(options));
             })
      .add_option("program", load->text, "G-code file, read by the daemon's host")
      ->required();
  auto mdi = std::make_shared<ClientOptions>();
  CLI::App& mdi_app = add_sender(app, exit, mdi, "mdi", "Run a line of G-code at once: trunnion mdi 'G0 X10'",
                                 [](const Machine&, const ClientOptions& options) {
                                   return text_command(command_t::MDI, typed_lines(options.text));
                                 });
  mdi_app.add_option("line", mdi->text, "G-code, in quotes; lines are separated by \\n")->required();
  add_wait(mdi_app, mdi);
}

void add_motion_clients(CLI::App& app, Exit& exit) {
  const struct {
    const char* name;
    const char* help;
    std::int8_t verb;
    bool wait;
  } kPlain[] = {
      {"hold", "Brake on the path and stand still; 'resume' goes on. A jog ends", command_t::HOLD, false},
      {"resume",
       "Go on after a hold, a program stop (M0, M1), a tool change (M6) or a single block. At M6 it says "
       "that "
       "the tool is in the spindle. What was jogged away is led back first",
       command_t::RESUME, false},
      {"stop", "Brake on the path and end the program", command_t::STOP, true},
      {"estop", "Emergency stop: every drive brakes by its own ramp, then has no power", command_t::ESTOP,
       false},
      {"reset", "Clear a fault or an emergency stop and bring the drives up again", command_t::RESET, true},
  };
  for (const auto& entry : kPlain) {
    auto options = std::make_shared<ClientOptions>();
    CLI::App& client = add_sender(app, exit, options, entry.name, entry.help, plain(entry.verb));
    if (entry.wait) add_wait(client, options);
  }
}

constexpr double kPercentMax = 200.0;

// CLI11 would only say that it could not convert it.
std::string check_percent(const std::string& text) {
  std::size_t used = 0;
  try {
    std::stod(text, &used);
  } catch (const std::exception&) {
    used = 0;
  }
  if (used > 0 && used == text.size()) return "";
  std::string better = text.substr(0, used);
  if (used > 0 && text[used] == ',')
    if (const auto end = text.find_first_not_of("0123456789", used + 1);
        end == std::string::npos && used + 1 < text.size())
      better += "." + text.substr(used + 1);
  return used == 0 ? fmt::format("'{}' is no number; 0 to {:g} is legal", text, kPercentMax)
                   : fmt::format("'{}' is no number; write {}", text, better);
}

std::string check_line(const std::string& text) {
  const bool digits = !text.empty() && text.find_first_not_of("0123456789") == std::string::npos;
  return digits ? "" : fmt::format("'{}' is no line of a program; give a whole number, as 8", text);
}

void hear_interrupt(int) {}

// Ctrl-C says no, too: what was prepared must not stay so.
bool confirmed() {
  struct sigaction hears {};
  struct sigaction before {};
  hears.sa_handler = hear_interrupt;  // without SA_RESTART: the read ends
  sigaction(SIGINT, &hears, &before);
  fmt::print(stderr, "start? [y/N] ");
  std::string answer;
  char letter = 0;
  while (read(STDIN_FILENO, &letter, 1) == 1 && letter != '\n') answer += letter;
  sigaction(SIGINT, &before, nullptr);
  if (letter != '\n') fmt::print(stderr, "\n");
  return answer == "y" || answer == "Y" || answer == "yes";
}

// The program that was loaded before, if any, from its first line.
Exit give_up_start(ClientSession& session, const std::string& program) {
  const acknowledge_t answer = session.client.send(text_command(command_t::LOAD, program));
  if (answer.outcome != acknowledge_t::ACCEPTED) {
    fmt::print(stderr, "not started; the program stays prepared from there, and 'stop' gives that up\n");
    return exit_of(answer);
  }
  fmt::print(stderr, "not started; the loaded program begins at its first line again\n");
  return Exit::kUsage;
}

struct StartOptions {
  ClientOptions client;
  bool resume = false;
  double before_mm = 1;
};

// From a line or the recorded place: the daemon prepares and tells the way there, people say yes, then it
// starts.
Exit start(const StartOptions& options) {
  ClientSession session(options.client);
  if (options.client.count > 1 || options.resume) {
    const auto any = [](const status_t&) { return true; };
    const auto status = session.client.wait_status(any, options.client.timeout_s);
    const std::string program = status && status->state == "idle" ? status->program : "";
    command_t load = text_command(command_t::LOAD, "");
    load.value = options.resume ? -1 : static_cast<double>(options.client.count);
    load.speed = options.resume ? options.before_mm : 0;
    const Exit prepared = exit_of(session.client.send(load));
    if (prepared != Exit::kDone) return prepared;
    if (!options.client.yes && !confirmed()) return give_up_start(session, program);
  }
  return send(session, options.client, command_of(command_t::START));
}

void add_start(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<StartOptions>();
  const std::shared_ptr<ClientOptions> common(options, &options->client);
  CLI::App& client =
      add_client(app, exit, common, "start",
                 "Start the loaded program: from its beginning, from a line, or where it was given up. "
                 "While a program is held it does what 'resume' does",
                 [options](const ClientOptions&) { return start(*options); });
  CLI::Option* const from =
      client
          .add_option(
              "--from", common->count,
              "Begin at this line. The lines before it set modes, offsets and tool without motion. The "
              "way to the start is shown, and nothing moves before you agree")
          ->type_name("LINE")
          ->check(check_line)
          ->check(CLI::Range(2L, 100000000L));
  CLI::Option* const resume =
      client
          .add_flag(
              "--resume", options->resume,
              "Go on where the program was when the power failed, or at the last stop, emergency stop or "
              "fault, also in a loop or sub-program. Place and way are shown, and nothing moves before you "
              "agree")
          ->excludes(from);
  client
      .add_option(
          "--before", options->before_mm,
          "With --resume: cut so many mm of the path before the place again; default: 1. Where a move "
          "cannot be entered within, the cut begins with a whole line before that")
      ->type_name("MM")
      ->check(CLI::Range(0.0, 10000.0))
      ->needs(resume);
  client.add_flag("--yes", common->yes, "With --from and --resume: do not ask");
  add_wait(client, common);
}

void add_home(CLI::App& app, Exit& exit) {
  auto home = std::make_shared<ClientOptions>();
  CLI::App& home_app =
      add_sender(app, exit, home, "home", "Home the machine: the joints find their positions", home_command);
  home_app.add_option("joint", home->text, "Name of one joint; default: all");
  add_wait(home_app, home);
}

void add_override(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<ClientOptions>();
  auto what = std::make_shared<std::string>("feed");
  CLI::App& client =
      add_sender(app, exit, options, "override",
                 "Set the speed of feed moves, of rapid moves or of the spindle in percent: trunnion "
                 "override 80. A program takes feed and spindle out of your hand with M49, M50 P0 or M51 P0.",
                 [what](const Machine&, const ClientOptions& chosen) {
                   command_t command = command_of(*what == "rapid"      ? command_t::RAPID_OVERRIDE
                                                  : *what == "spindle"  ? command_t::SPINDLE_OVERRIDE
                                                  : *what == "adaptive" ? command_t::ADAPTIVE_FEED
                                                                        : command_t::OVERRIDE);
                   command.value = chosen.amount / 100;
                   return command;
                 });
  client
      .add_option("percent", options->amount,
                  "0 to 200; 100 is as programmed. Above 100 the axis limits still count. Rapid and "
                  "adaptive: at most 100")
      ->required()
      ->check(check_percent)
      ->check(CLI::Range(0.0, kPercentMax));
  client
      .add_option(
          "--of", *what,
          "whose speed: feed (jogs too), rapid, spindle, or adaptive, which acts where the program has M52")
      ->check(CLI::IsMember({"feed", "rapid", "spindle", "adaptive"}))
      ->capture_default_str();
}

void add_step(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<ClientOptions>();
  auto on = std::make_shared<std::string>();
  add_sender(app, exit, options, "step",
             "Single block: after 'on', the machine stands still at the end of every line until 'resume' or "
             "'start'. Lines too short to stop on are run together with the next",
             [on](const Machine&, const ClientOptions&) {
               command_t command = command_of(command_t::SINGLE_BLOCK);
               command.value = *on == "on" ? 1 : 0;
               return command;
             })
      .add_option("switch", *on, "on or off")
      ->required()
      ->check(CLI::IsMember({"on", "off"}));
}

constexpr struct {
  const char* name;
  std::int8_t verb;
} kSwitches[] = {{"optional-stop", command_t::OPTIONAL_STOP},
                 {"block-delete", command_t::BLOCK_DELETE},
                 {"dry-run", command_t::DRY_RUN},
                 {"machine-lock", command_t::MACHINE_LOCK}};

command_t switch_command(const std::string& name, bool on) {
  command_t command{};
  for (const auto& entry : kSwitches)
    if (name == entry.name) command = command_of(entry.verb);
  command.value = on ? 1 : 0;
  return command;
}

void add_switch(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<ClientOptions>();
  auto on = std::make_shared<std::string>();
  CLI::App& client = add_sender(
      app, exit, options, "switch",
      "Set a switch. optional-stop: M1 stops; it acts at once, also while a program runs. block-delete: "
      "lines "
      "that begin with / are skipped; in a program that runs, those that are not read yet, and the answer "
      "says "
      "which. You set the others while the machine is idle. dry-run: feed moves go as fast as the joints "
      "can, "
      "with the spindle off and the tool away from the work. machine-lock: programs run while no joint moves",
      [on](const Machine&, const ClientOptions& chosen) { return switch_command(chosen.text, *on == "on"); });
  std::vector<std::string> names;
  for (const auto& entry : kSwitches) names.emplace_back(entry.name);
  client.add_option("name", options->text, "optional-stop, block-delete, dry-run or machine-lock")
      ->required()
      ->check(CLI::IsMember(names));
  client.add_option("switch", *on, "on or off")->required()->check(CLI::IsMember({"on", "off"}));
}

void add_notes(CLI::App& app, Exit& exit) {
  auto seen = std::make_shared<ClientOptions>();
  add_sender(app, exit, seen, "acknowledge",
             "Say that an alarm was seen: it is shown no longer, once it is over. 'status' lists them",
             [](const Machine&, const ClientOptions& options) {
               command_t command = command_of(command_t::ACKNOWLEDGE);
               command.value = static_cast<double>(options.count);
               return command;
             })
      .add_option("number", seen->count, "The alarm's number; default: all of them")
      ->check(check_whole(1));
  auto parts = std::make_shared<ClientOptions>();
  parts->count = -1;
  add_client(app, exit, parts, "parts",
             "Show the counter of parts, or set it, as for a new order: trunnion parts 0", count_parts)
      .add_option("count", parts->count, "Parts made so far: 0 or more")
      ->check(check_whole(0));
}

void add_correction(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<ClientOptions>();
  auto on = std::make_shared<std::string>();
  CLI::App& client = add_sender(app, exit, options, "correction",
                                "Switch a correction on or off. Geometric and joint_table change only while "
                                "the machine is idle, the others at any time",
                                [on](const Machine&, const ClientOptions& chosen) {
                                  command_t command = text_command(command_t::CORRECTION, chosen.text);
                                  command.value = *on == "on" ? 1 : 0;
                                  return command;
                                });
  client.add_option("name", options->text, "As 'trunnion status' lists it")->required();
  client.add_option("switch", *on, "on or off")->required()->check(CLI::IsMember({"on", "off"}));
}

void add_watchers(CLI::App& app, Exit& exit) {
  auto status = std::make_shared<ClientOptions>();
  add_client(app, exit, status, "status", "Show the state of machine and daemon, once", show_status)
      .add_flag("--json", status->json, "For programs: one JSON object");
  auto watch = std::make_shared<ClientOptions>();
  CLI::App& watch_app = add_client(
      app, exit, watch, "monitor",
      "Show what the machine does and where it is, on a screen that follows it until Ctrl-C", monitor);
  watch_app.add_flag("--lines", watch->lines, "Write a line for each message instead, as into a pipe");
  watch_app.add_flag("--json", watch->json, "For programs: one JSON object a line; mm and rad");
  watch_app.add_option("--count", watch->count, "End after so many messages; 0: no end")
      ->check(CLI::NonNegativeNumber);
}

}  // namespace

void add_clients(CLI::App& app, Exit& exit) {
  add_program_clients(app, exit);
  add_start(app, exit);
  add_motion_clients(app, exit);
  add_jog(app, exit);
  add_retrace(app, exit);
  add_wheel(app, exit);
  add_home(app, exit);
  add_override(app, exit);
  add_step(app, exit);
  add_switch(app, exit);
  add_notes(app, exit);
  add_correction(app, exit);
  add_watchers(app, exit);
}

}  // namespace trn
