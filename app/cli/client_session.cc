#include "app/cli/client_session.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <string_view>
#include <vector>

#include "app/cli/named_files.h"
#include "app/client/access_config.h"
#include "app/client/daemon_line.h"
#include "app/client/running_daemons.h"
#include "core/config.h"
#include "core/fault.h"
#include "hal/lcm_link.h"

namespace trn {

using trunnion::acknowledge_t;
using trunnion::command_t;
using trunnion::status_t;

Exit exit_of(const acknowledge_t& answer) {
  if (!answer.message.empty()) fmt::print(stderr, "{}\n", answer.message);
  switch (answer.outcome) {
    case acknowledge_t::ACCEPTED:
      return Exit::kDone;
    case acknowledge_t::BAD_PROGRAM:
      return Exit::kBadProgram;
    case acknowledge_t::REFUSED:
      return Exit::kUsage;
    default:
      return Exit::kMachineFault;
  }
}

namespace {

// A jog or a switch in a hold is done when the machine stands there.
bool stands_away(const status_t& status) { return status.state == "holding" && status.detour == "away"; }

// And a line that was typed meanwhile when it is answered.
bool held_program(const status_t& status, std::int8_t verb) {
  return verb == command_t::MDI && status.state == "holding" && status.program != "mdi";
}

bool at_work(const status_t& status) {
  return !stands_away(status) && status.state != "idle" && status.state != "off" && status.state != "fault" &&
         status.state != "estop";
}

void print_fault(const status_t& status) {
  const std::string at = status.fault_joint.empty() ? "" : fmt::format(" at joint {}", status.fault_joint);
  fmt::print(stderr, "fault: {}{}{}\n", status.fault, at,
             status.message.empty() ? "" : ": " + status.message);
  if (const FaultInfo* fault = find_fault(status.fault); fault && status.fault != "ok")
    fmt::print(stderr, "{}; {}\n", fault->meaning, fault->remedy);
}

volatile std::sig_atomic_t interrupted = 0;
void note_interrupt(int) { interrupted = 1; }

/// Ctrl-C ends the waiting, and not the motion: which is said.
class HearsInterrupt {
 public:
  HearsInterrupt() {
    interrupted = 0;
    struct sigaction hears {};
    hears.sa_handler = note_interrupt;
    sigaction(SIGINT, &hears, &before_);
  }
  ~HearsInterrupt() { sigaction(SIGINT, &before_, nullptr); }
  HearsInterrupt(const HearsInterrupt&) = delete;
  HearsInterrupt& operator=(const HearsInterrupt&) = delete;

 private:
  struct sigaction before_ {};
};

std::string_view work_of(std::int8_t verb) {
  return verb == command_t::START ? "the program" : verb == command_t::MDI ? "the typed line" : "the motion";
}

// Until the command's work is over; kMachineFault if it ended in a fault, or was ended by somebody else. The
// state says that: 'stopping' is reached by a stop, and from a jog by a hold, too.
Exit wait_until_rest(CommandClient& client, const acknowledge_t& answer, const command_t& command,
                     double patience_s) {
  const HearsInterrupt hears;
  const std::int8_t verb = command.verb;
  const bool ends_itself = verb == command_t::STOP || (verb == command_t::JOG && command.value == 0);
  bool stopped = false;
  const auto status = client.wait_status(
      [&](const status_t& now) {
        const bool counts = now.count >= answer.status_count;
        stopped |= counts && now.state == "stopping" && !ends_itself;
        return interrupted != 0 || (counts && (!at_work(now) || held_program(now, verb)));
      },
      patience_s);
  if (interrupted != 0 && status && at_work(*status)) {
    fmt::print(stderr, "\nthe machine goes on; 'trunnion stop' ends it\n");
    return Exit::kMachineFault;
  }
  if (!status) {
    fmt::print(stderr, "trunnion: the machine is still at work after {} s\n", patience_s);
    return Exit::kMachineFault;
  }
  if (stands_away(*status) || held_program(*status, verb)) return Exit::kDone;
  if (status->state != "idle") {
    print_fault(*status);
    return Exit::kMachineFault;
  }
  if (status->program_failed) {
    fmt::print(stderr, "{}\n", status->message);
    return Exit::kBadProgram;
  }
  if (!stopped) return Exit::kDone;
  fmt::print(stderr, "stopped by another client: {} did not come to its end\n", work_of(verb));
  return Exit::kMachineFault;
}

}  // namespace

ClientSession::ClientSession(const ClientOptions& options)
    : machine(client_machine(options.machine, options.remote)),
      client(make_client(machine, options.remote, options.timeout_s)) {}

void ClientSession::compare_configs(double timeout_s) {
  // A daemon may answer a command before its first status arrives; what it loaded is told only there.
  const auto any = [](const status_t&) { return true; };
  try {
    if (!client.last_status()) client.wait_status(any, std::min(0.5, timeout_s / 2));
  } catch (const NoAnswer&) {  // it has ended since, as after a shutdown; the command was answered
    return;
  }
  const status_t* status = client.last_status();
  if (status && !status->version.empty() && status->version != TRN_VERSION)
    fmt::print(stderr, "warning: the daemon of '{}' is version {}, and this is {}; restart the daemon\n",
               machine.name, status->version, TRN_VERSION);
  if (!status || status->config_mark.empty()) return;
  if (file_mark(machine.root.file()) == status->config_mark) return;
  const std::string own = std::filesystem::absolute(machine.root.file()).lexically_normal();
  if (own == status->config_file) {
    fmt::print(stderr, "warning: {} has changed since the daemon was started; it counts after a restart\n",
               own);
  } else {
    fmt::print(stderr, "warning: the daemon of '{}' runs with {}, which is not the same as {}\n",
               machine.name, status->config_file, own);
  }
}

Exit send(ClientSession& session, const ClientOptions& options, const command_t& command,
          const std::string& typed) {
  acknowledge_t answer = session.client.send(command);
  const std::string name = "'mdi'";
  if (const std::size_t at = answer.message.find(name); !typed.empty() && at != std::string::npos)
    answer.message.replace(at, name.size(), fmt::format("'{}'", typed));
  session.compare_configs(options.timeout_s);
  const Exit exit = exit_of(answer);
  if (exit != Exit::kDone || !options.wait) return exit;
  return wait_until_rest(session.client, answer, command, options.patience_s);
}

int joint_index(const Machine& machine, const std::string& name) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < machine.joints.size(); ++i) {
    if (machine.joints[i].name == name) return static_cast<int>(i);
    names.push_back(machine.joints[i].name);
  }
  throw CLI::ValidationError("JOINT", fmt::format("machine '{}' has no joint '{}'; it has {}", machine.name,
                                                  name, fmt::join(names, ", ")));
}

command_t command_of(std::int8_t verb) {
  command_t command{};
  command.verb = verb;
  return command;
}

command_t text_command(std::int8_t verb, const std::string& text) {
  command_t command = command_of(verb);
  command.text = text;
  return command;
}

std::string one_line(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

CLI::App& add_client(CLI::App& app, Exit& exit, const std::shared_ptr<ClientOptions>& options,
                     const std::string& name, const std::string& help,
                     std::function<Exit(const ClientOptions&)> work) {
  CLI::App* client = app.add_subcommand(name, help);
  client->add_option("--machine,-m", options->machine, kMachineHelp)->envname("TRUNNION_MACHINE");
  add_timeout(*client, options->timeout_s);
  client->add_option("--remote", options->remote, kRemoteHelp);
  client->footer(
      "Exit codes: 0 done, 2 bad program, 3 bad config, 4 fault, no daemon, or stopped by another client,\n"
      "5 not legal in this state or usage.");
  client->callback([&exit, options, work] { exit = work(*options); });
  return *client;
}

void add_wait(CLI::App& client, const std::shared_ptr<ClientOptions>& options) {
  client.add_flag("--wait", options->wait, "Wait until the machine is at rest again");
  client.add_option("--patience", options->patience_s, "With --wait: give up after so many seconds")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}

}  // namespace trn
