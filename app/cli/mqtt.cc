#include <fmt/format.h>

#include <atomic>
#include <csignal>
#include <memory>
#include <stdexcept>
#include <string>

#include "app/cli/commands.h"
#include "app/client/access_config.h"
#include "app/client/private_file.h"
#include "core/config.h"
#include "core/machine.h"
#include "hal/lcm_link.h"
#include "panel/server/mqtt_publisher.h"

namespace trn {

namespace {

std::atomic<bool> mqtt_ends = false;

struct MqttOptions {
  std::string machine, broker = "127.0.0.1", password_file;
  MqttConfig mqtt;
};

// HOST or HOST:PORT.
void read_broker(const std::string& text, MqttConfig& mqtt) {
  const std::size_t colon = text.rfind(':');
  mqtt.host = text.substr(0, colon);
  if (colon == std::string::npos) return;
  try {
    std::size_t end = 0;
    mqtt.port = std::stoi(text.substr(colon + 1), &end);
    if (colon + 1 + end == text.size() && mqtt.port > 0 && mqtt.port < 65536) return;
  } catch (const std::logic_error&) {
    // told below
  }
  throw std::runtime_error(fmt::format("'{}' is no HOST:PORT, as broker.example:8883 is", text));
}

Exit publish(MqttOptions& options) {
  const Machine machine = read_machine(load_config(options.machine));
  read_broker(options.broker, options.mqtt);
  if (!options.password_file.empty()) {
    const std::string text = read_private_file(options.password_file);
    options.mqtt.password = text.substr(0, text.find('\n'));
  }
  struct sigaction action {};
  action.sa_handler = [](int) { mqtt_ends = true; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  publish_over_mqtt(options.mqtt, read_lcm(machine.root, machine.name), read_access(machine.root), mqtt_ends);
  return Exit::kDone;
}

}  // namespace

void add_mqtt(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<MqttOptions>();
  CLI::App* command = app.add_subcommand("mqtt", "Tell the state of a daemon's machine to an MQTT broker");
  command
      ->add_option("--machine,-m", options->machine,
                   "The machine whose daemon runs, by its name, or its config (.toml)")
      ->envname("TRUNNION_MACHINE")
      ->required();
  command->add_option("--broker", options->broker, "HOST or HOST:PORT; ports 1883, with TLS 8883")
      ->capture_default_str();
  command
      ->add_option("--ca", options->mqtt.authority_file,
                   "Certificates of who signed the broker's, PEM: TLS. Without it, no password crosses a "
                   "network")
      ->check(CLI::ExistingFile);
  command->add_option("--user", options->mqtt.user, "Name at the broker");
  command->add_option("--password-file", options->password_file,
                      "Its first line is the password; only this user may read it (mode 0600)");
  command->add_option("--prefix", options->mqtt.prefix, "Topics begin with PREFIX/MACHINE/")
      ->capture_default_str();
  command->add_option("--motion-hz", options->mqtt.motion_hz, "How often positions are told; 0: never")
      ->check(CLI::Range(0.0, 20.0))
      ->capture_default_str();
  command->footer(
      "Example: trunnion mqtt --machine mill.toml --broker broker.example --ca /etc/ssl/shop.pem --user "
      "mill\n"
      "         --password-file /etc/trunnion/mqtt.password\n"
      "Exit codes: 0 ended by Ctrl-C, 3 bad config, 4 a file or the settings cannot be used, 5 usage.");
  command->callback([options, &exit] { exit = publish(*options); });
}

}  // namespace trn
