#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cctype>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <iostream>
#include <nlohmann/json.hpp>

#include "app/cli/client_session.h"
#include "app/cli/commands.h"
#include "app/cli/shown_state.h"
#include "app/client/command_client.h"
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
Json status_json(const status_t& status) {
  const FaultInfo* fault = find_fault(status.fault);
  Json out = json_of(status);
  out["fault_meaning"] = fault ? fault->meaning : "";
  out["fault_remedy"] = fault ? fault->remedy : "";
  out["features"] = features_json(features_of(status));
  return out;
}

Exit show_status(const ClientOptions& options) {
  ClientSession session(options);
  session.client.watch([&](const status_t& status, const motion_t& motion) {
    if (options.json)
      fmt::print("{}\n", one_line(status_json(status)));
    else
      fmt::print("{}", status_text(status, motion));
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

MakeCommand plain(std::int8_t verb) {
  return [verb](const Machine&, const ClientOptions&) { return command_of(verb); };
}

// As the daemon's host knows it.
std::string program_path(const ClientOptions& options) {
  const std::filesystem::path path = options.text;
  if (!options.remote.empty() && path.is_relative())
    throw CLI::ValidationError("program", "from another host, name the whole path on the daemon's");
  return std::filesystem::absolute(path).lexically_normal();
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
  CLI::App& mdi_app = add_sender(app, exit, mdi, "mdi",
                                 "Run a line of G-code at once, e.g. trunnion mdi 'G0 X10' --machine ...",
                                 [](const Machine&, const ClientOptions& options) {
                                   return text_command(command_t::MDI, options.text);
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
      {"hold", "Slow down on the path and stand; 'resume' goes on. A jog is ended", command_t::HOLD, false},
      {"resume",
       "Cycle start: go on after a hold, a program stop (M0, M1) or a single block; after M6 it says that "
       "the tool "
       "is in the spindle",
       command_t::RESUME, false},
      {"stop", "Slow down on the path and give the program up", command_t::STOP, true},
      {"estop", "Emergency stop: every drive brakes by its own ramp, then loses power", command_t::ESTOP,
       false},
      {"reset", "Clear a fault or an emergency stop and bring the drives up again", command_t::RESET, true},
  };
  for (const auto& entry : kPlain) {
    auto options = std::make_shared<ClientOptions>();
    CLI::App& client = add_sender(app, exit, options, entry.name, entry.help, plain(entry.verb));
    if (entry.wait) add_wait(client, options);
  }
}

bool confirmed() {
  fmt::print(stderr, "start? [y/N] ");
  std::string answer;
  std::getline(std::cin, answer);
  return answer == "y" || answer == "Y" || answer == "yes";
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
    command_t load = text_command(command_t::LOAD, "");
    load.value = options.resume ? -1 : static_cast<double>(options.client.count);
    load.speed = options.resume ? options.before_mm : 0;
    const Exit prepared = exit_of(session.client.send(load));
    if (prepared != Exit::kDone) return prepared;
    if (!options.client.yes && !confirmed()) {
      fmt::print(stderr, "not started; the program stays prepared from there\n");
      return Exit::kUsage;
    }
  }
  return send(session, options.client, command_of(command_t::START));
}

void add_start(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<StartOptions>();
  const std::shared_ptr<ClientOptions> common(options, &options->client);
  CLI::App& client = add_client(app, exit, common, "start", "Start the loaded program",
                                [options](const ClientOptions&) { return start(*options); });
  CLI::Option* const from =
      client
          .add_option("--from", common->count,
                      "Begin at this line: the lines before it set modes, offsets and tool; the way to where "
                      "they end is shown, and nothing moves before you have agreed")
          ->check(CLI::Range(2L, 100000000L));
  CLI::Option* const resume =
      client
          .add_flag(
              "--resume", options->resume,
              "Go on where the program was when the power failed, or at the last stop, emergency stop or "
              "fault, also in a loop or sub-program; place and way are shown first")
          ->excludes(from);
  client
      .add_option("--before", options->before_mm,
                  "With --resume: begin with the line that lies at least so many mm of the path before the "
                  "place; default: 1")
      ->check(CLI::Range(0.0, 10000.0))
      ->needs(resume);
  client.add_flag("--yes", common->yes, "With --from and --resume: do not ask");
  add_wait(client, common);
}

void add_home(CLI::App& app, Exit& exit) {
  auto home = std::make_shared<ClientOptions>();
  CLI::App& home_app =
      add_sender(app, exit, home, "home", "Let the joints find their positions", home_command);
  home_app.add_option("joint", home->text, "Name of one joint; default: all");
  add_wait(home_app, home);
}

void add_override(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<ClientOptions>();
  auto what = std::make_shared<std::string>("feed");
  CLI::App& client =
      add_sender(app, exit, options, "override",
                 "Set the speed of feed moves, of rapid moves or of the spindle, now and later. M49, M50 P0 "
                 "and M51 P0 of a program take feed and spindle out of the operator's hand.",
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
                  "0 over 100 (as programmed) to 200; feed above 100 as far as the joints allow; rapid and "
                  "adaptive at most 100")
      ->required()
      ->check(CLI::Range(0.0, 200.0));
  client.add_option("--of", *what, "feed (and jogs), rapid, spindle; adaptive acts where M52 lets it")
      ->check(CLI::IsMember({"feed", "rapid", "spindle", "adaptive"}))
      ->capture_default_str();
}

void add_step(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<ClientOptions>();
  auto on = std::make_shared<std::string>();
  add_sender(app, exit, options, "step",
             "Single block: 'on' lets the machine stand on the path at the end of every line of the program "
             "until 'resume' or 'start'; one that comes too soon to stop there is passed",
             [on](const Machine&, const ClientOptions&) {
               command_t command = command_of(command_t::SINGLE_BLOCK);
               command.value = *on == "on" ? 1 : 0;
               return command;
             })
      .add_option("switch", *on, "on or off")
      ->required()
      ->check(CLI::IsMember({"on", "off"}));
}

void add_switch(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<ClientOptions>();
  auto on = std::make_shared<std::string>();
  CLI::App& client = add_sender(
      app, exit, options, "switch",
      "Operator's switches: optional-stop, whether M1 stops, at once; block-delete, whether "
      "lines that begin with / are skipped, while the machine is idle",
      [on](const Machine&, const ClientOptions& chosen) {
        command_t command =
            command_of(chosen.text == "optional-stop" ? command_t::OPTIONAL_STOP : command_t::BLOCK_DELETE);
        command.value = *on == "on" ? 1 : 0;
        return command;
      });
  client.add_option("name", options->text, "optional-stop or block-delete")
      ->required()
      ->check(CLI::IsMember({"optional-stop", "block-delete"}));
  client.add_option("switch", *on, "on or off")->required()->check(CLI::IsMember({"on", "off"}));
}

void add_correction(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<ClientOptions>();
  auto on = std::make_shared<std::string>();
  CLI::App& client =
      add_sender(app, exit, options, "correction",
                 "Switch a correction on or off: geometric and joint_table while the machine is idle, "
                 "the others at any time",
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
  CLI::App& watch_app = add_client(app, exit, watch, "monitor",
                                   "Show what the machine does and where it is, on one screen that follows "
                                   "it, until Ctrl-C",
                                   monitor);
  watch_app.add_flag("--lines", watch->lines, "One line for each message instead; so also into a pipe");
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
  add_home(app, exit);
  add_override(app, exit);
  add_step(app, exit);
  add_switch(app, exit);
  add_correction(app, exit);
  add_watchers(app, exit);
}

}  // namespace trn
