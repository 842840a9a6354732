#include <memory>
#include <string>

#include "app/cli/client_session.h"
#include "app/cli/commands.h"

namespace trn {

namespace {

using trunnion::acknowledge_t;
using trunnion::command_t;
using trunnion::status_t;

constexpr double kAll_mm = 1e9;

struct Way {
  const char* name;
  const char* help;
  double sense;
};

Exit move_along(const ClientOptions& options, double sense) {
  ClientSession session(options);
  command_t command = command_of(command_t::JOG);
  command.frame = command_t::PATH;
  command.value = sense * options.amount;
  const acknowledge_t answer = session.client.send(command);
  const Exit obeyed = exit_of(answer);
  if (obeyed != Exit::kDone || !options.wait) return obeyed;
  const auto stands = [&](const status_t& now) {
    return now.count >= answer.status_count && (now.state != "holding" || now.detour.empty());
  };
  const auto status = session.client.wait_status(stands, options.patience_s);
  return status && status->state == "holding" ? Exit::kDone : Exit::kMachineFault;
}

void add_way(CLI::App& app, Exit& exit, const Way& way) {
  auto options = std::make_shared<ClientOptions>();
  options->amount = kAll_mm;
  CLI::App& client =
      add_client(app, exit, options, way.name, way.help,
                 [sense = way.sense](const ClientOptions& chosen) { return move_along(chosen, sense); });
  client
      .add_option("mm", options->amount,
                  "So much of the path; a degree counts as 1 mm. Default: all there is, until 'hold'")
      ->check(CLI::Range(0.001, kAll_mm));
  add_wait(client, options);
}

}  // namespace

void add_retrace(CLI::App& app, Exit& exit) {
  add_way(
      app, exit,
      {"reverse",
       "While a program is held: move back along its path, at half its speed at most. For example: "
       "trunnion reverse 5. It ends at the last event or output of the program. 'resume' goes on from there",
       -1});
  add_way(app, exit,
          {"forward", "After 'reverse': move forward along the path again, up to the place of the hold", 1});
}

}  // namespace trn
