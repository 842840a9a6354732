#include "app/cli/client_session.h"

#include <fmt/format.h>

#include <string_view>

#include "app/client/access_config.h"
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

bool at_work(const status_t& status) {
  return status.state != "idle" && status.state != "off" && status.state != "fault" &&
         status.state != "estop";
}

void print_fault(const status_t& status) {
  const std::string at = status.fault_joint.empty() ? "" : fmt::format(" at joint {}", status.fault_joint);
  fmt::print(stderr, "fault: {}{}{}\n", status.fault, at,
             status.message.empty() ? "" : ": " + status.message);
  if (const FaultInfo* fault = find_fault(status.fault); fault && status.fault != "ok")
    fmt::print(stderr, "{}; {}\n", fault->meaning, fault->remedy);
}

// Until the command's work is over; kMachineFault if it ended in a fault.
Exit wait_until_rest(CommandClient& client, const acknowledge_t& answer, double patience_s) {
  const auto status = client.wait_status(
      [&](const status_t& now) { return now.count >= answer.status_count && !at_work(now); }, patience_s);
  if (!status) {
    fmt::print(stderr, "trunnion: the machine is still at work after {} s\n", patience_s);
    return Exit::kMachineFault;
  }
  if (status->state != "idle") {
    print_fault(*status);
    return Exit::kMachineFault;
  }
  if (!status->program_failed) return Exit::kDone;
  fmt::print(stderr, "{}\n", status->message);
  return Exit::kBadProgram;
}

}  // namespace

Exit send(ClientSession& session, const ClientOptions& options, const command_t& command) {
  const acknowledge_t answer = session.client.send(command);
  const Exit exit = exit_of(answer);
  if (exit != Exit::kDone || !options.wait) return exit;
  return wait_until_rest(session.client, answer, options.patience_s);
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
  client
      ->add_option("--machine", options->machine,
                   "Config of the machine whose daemon is asked (configs/X.toml)")
      ->envname("TRUNNION_MACHINE")
      ->required();
  client->add_option("--timeout", options->timeout_s, "Seconds to wait for the daemon's first answer")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  client->add_option("--remote", options->remote, kRemoteHelp);
  client->footer(
      "Exit codes: 0 done, 2 bad program, 3 bad config, 4 fault or no daemon, 5 not legal in this state or "
      "usage.");
  client->callback([&exit, options, work] { exit = work(*options); });
  return *client;
}

void add_wait(CLI::App& client, const std::shared_ptr<ClientOptions>& options) {
  client.add_flag("--wait", options->wait,
                  "Return when the machine is at rest again, not when it has understood");
  client.add_option("--patience", options->patience_s, "With --wait: at most this many seconds")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}

}  // namespace trn
