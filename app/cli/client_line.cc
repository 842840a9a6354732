#include "app/cli/client_line.h"

#include <filesystem>
#include <memory>

#include "app/client/access_config.h"
#include "app/client/daemon_line.h"
#include "app/client/gateway_config.h"
#include "app/client/remote_line.h"
#include "app/client/running_daemons.h"
#include "hal/lcm_link.h"

namespace trn {

Machine client_machine(const std::string& machine, const std::string& key_file) {
  const bool is_file = machine.find_first_of("/.") != std::string::npos ||
                       (!machine.empty() && std::filesystem::exists(machine));
  if (!is_file && !key_file.empty())
    throw NoAnswer("over a gateway the machine is not known by itself: name its config with --machine");
  return read_machine(load_config(is_file ? machine : config_of_daemon(machine)));
}

void add_timeout(CLI::App& client, double& timeout_s) {
  client.add_option("--timeout", timeout_s, "Seconds to wait for the daemon's first answer")
      ->envname("TRUNNION_TIMEOUT")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
}

CommandClient make_client(const Machine& machine, const std::string& key_file, double timeout_s) {
  const LcmConfig names = read_lcm(machine.root, machine.name);
  if (key_file.empty()) return CommandClient({names, read_access(machine.root), timeout_s});
  const GatewayConfig gateway = read_gateway(machine.root);
  if (gateway.url.empty())
    throw machine.root.error("gateway", "--remote needs the gateway's group: '[gateway] url' in this config");
  return {std::make_unique<RemoteLine>(names, gateway.url, key_file), timeout_s};
}

}  // namespace trn
