#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "app/cli/commands.h"
#include "app/cli/kinematics_json.h"
#include "app/cli/panel_page.h"
#include "app/cli/panel_user.h"
#include "app/client/access_config.h"
#include "app/client/gateway_config.h"
#include "app/client/signing_key.h"
#include "app/session/drawing_config.h"
#include "core/config.h"
#include "core/machine.h"
#include "hal/lcm_link.h"
#include "panel/server/panel_config.h"
#include "panel/server/panel_key.h"
#include "panel/server/panel_server.h"
#include "panel/server/user_file.h"
#include "panel/server/web_rules.h"

namespace trn {

namespace {

std::atomic<bool> stop_asked = false;

struct PanelOptions {
  std::string machine, listen = "127.0.0.1:8470", page, programs, key_file, cert, tls_key, users, remote;
  double session_hours = 12;
  std::vector<std::string> others;
};

std::string own_folder(const std::string& machine) {
  const char* state = std::getenv("STATE_DIRECTORY");
  const char* home = std::getenv("HOME");
  const std::string base =
      state ? std::string(state) : std::string(home ? home : "") + "/.local/state/trunnion";
  return base + "/panel/" + machine;
}

std::string find_page(const std::string& named) {
  const std::string page = find_panel_page(named);
  if (page.empty())
    throw std::runtime_error(fmt::format(
        "there is no page in {}; install the package trunnion-panel, or build it with "
        "'panel/build.sh FOLDER' and name the folder with --page",
        named.empty() ? std::filesystem::path(own_program()).parent_path().string() + "/panel" : named));
  return page;
}

void check_readable(const std::string& path) {
  if (access(path.c_str(), R_OK) != 0)
    throw std::runtime_error(fmt::format("{}: {}", path, std::strerror(errno)));
}

// Nothing where the panel stays on the loopback, with a key and without TLS.
std::optional<TlsConfig> tls_of(const PanelOptions& options, const ListenPlace& listen) {
  if (options.cert.empty() && options.tls_key.empty() && options.users.empty()) {
    if (is_loopback(listen)) return std::nullopt;
    throw std::runtime_error(
        fmt::format("on {} the panel listens with TLS and a log-in only: give --cert and --key, and name "
                    "who may log in with 'trunnion panel user add'",
                    listen.address));
  }
  if (options.cert.empty() || options.tls_key.empty())
    throw std::runtime_error("TLS needs both --cert and --key; a log-in needs TLS");
  check_readable(options.cert);
  check_readable(options.tls_key);
  struct stat info {};
  if (stat(options.tls_key.c_str(), &info) == 0 && (info.st_mode & S_IRWXO))
    throw std::runtime_error(fmt::format("{}: everybody can read or write this private key: chmod o= {}",
                                         options.tls_key, options.tls_key));
  const std::string users = options.users.empty() ? own_users_file() : options.users;
  if (read_users(users).empty())
    throw std::runtime_error(
        fmt::format("{}: nobody may log in; 'trunnion panel user add NAME --role ROLE'", users));
  const auto life = std::chrono::duration<double, std::ratio<3600>>(options.session_hours);
  return TlsConfig{options.cert, options.tls_key, users,
                   std::chrono::duration_cast<std::chrono::seconds>(life)};
}

std::optional<PanelKey> key_of(const PanelOptions& options, bool logs_in) {
  if (!options.key_file.empty()) return PanelKey::read(options.key_file);
  return logs_in ? std::nullopt : std::optional(PanelKey::make());
}

// NAME=ADDRESS each.
std::map<std::string, std::string> pages_of(const std::vector<std::string>& others) {
  std::map<std::string, std::string> out;
  for (const std::string& text : others) {
    const std::size_t sign = text.find('=');
    const std::string address = sign == std::string::npos ? "" : text.substr(sign + 1);
    if (!address.starts_with("http://") && !address.starts_with("https://"))
      throw std::runtime_error(
          fmt::format("'{}' is no NAME=ADDRESS, as mill=https://mill.example:8470 is", text));
    out[text.substr(0, sign)] = address;
  }
  return out;
}

// Without a key file the daemon is on this computer.
std::optional<RemoteMachine> remote_of(const Machine& machine, const std::string& key_file) {
  if (key_file.empty()) return std::nullopt;
  const GatewayConfig gateway = read_gateway(machine.root);
  if (gateway.url.empty())
    throw machine.root.error("gateway", "--remote needs the gateway's group: '[gateway] url' in this config");
  const SigningKey key = SigningKey::read(key_file);
  for (const GatewayConfig::Key& known : gateway.keys)
    if (known.name == key.name()) return RemoteMachine{gateway.url, key_file, key.name(), known.role};
  throw machine.root.error(
      "gateway",
      fmt::format("no [[gateway.key]] is called '{}', as the key in {} is; take the config that the "
                  "machine's computer has",
                  key.name(), key_file));
}

// A drawing that is none stops no machine, but whoever starts the panel wants to see it.
std::vector<DrawnPart> drawings_of(const Machine& machine) {
  constexpr std::uintmax_t kLargest = 64 << 20;
  std::vector<DrawnPart> out;
  for (const Drawing& drawing : read_drawings(machine)) {
    std::error_code error;
    const std::uintmax_t size = std::filesystem::file_size(drawing.file, error);
    if (error) throw drawing.table.error("stl", fmt::format("{}: {}", drawing.file, error.message()));
    if (size > kLargest)
      throw drawing.table.error("stl", fmt::format("{} is larger than 64 MB", drawing.file));
    out.push_back({drawing.part, std::filesystem::absolute(drawing.file)});
  }
  return out;
}

Exit serve(const PanelOptions& options) {
  if (options.machine.empty()) throw CLI::RequiredError("--machine");
  Machine machine = read_machine(load_config(options.machine));
  const std::string programs = options.programs.empty() ? own_folder(machine.name) : options.programs;
  std::filesystem::create_directories(programs);
  const LcmConfig lcm = read_lcm(machine.root, machine.name);
  const AccessConfig access = read_access(machine.root);
  const ListenPlace listen = read_listen_place(options.listen);
  const std::optional<TlsConfig> tls = tls_of(options, listen);
  // What a unit prints is in the journal, which others may read: the key of a file is not printed.
  const bool once = options.key_file.empty();
  const PanelConfig config{machine,
                           std::filesystem::absolute(options.machine),
                           TRN_VERSION,
                           listen,
                           find_page(options.page),
                           std::filesystem::absolute(programs),
                           lcm,
                           access,
                           key_of(options, tls.has_value()),
                           remote_of(machine, options.remote),
                           tls,
                           kinematics_json(machine),
                           drawings_of(machine),
                           own_program(),
                           once,
                           pages_of(options.others)};
  struct sigaction action {};
  action.sa_handler = [](int) { stop_asked = true; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  serve_panel(config, stop_asked);
  return Exit::kDone;
}

void add_tls(CLI::App& command, PanelOptions& options) {
  command.add_option("--cert", options.cert,
                     "certificate of this computer, PEM: pages come over TLS and log in");
  command.add_option("--key", options.tls_key, "private key of the certificate, PEM");
  command.add_option(
      "--users", options.users,
      "file of those who may log in, as 'trunnion panel user' keeps it. Without it, " + own_users_file());
  command.add_option("--session-hours", options.session_hours, "a log-in is good for so long")
      ->check(CLI::Range(0.0005, 1000.0))
      ->capture_default_str();
}

}  // namespace

void add_panel(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<PanelOptions>();
  CLI::App* command =
      app.add_subcommand("panel", "Serve the operator's page of a daemon's machine to a browser");
  command
      ->add_option("--machine,-m", options->machine,
                   "the machine whose daemon runs, by its name, or its config (.toml)")
      ->envname("TRUNNION_MACHINE");
  command
      ->add_option(
          "--listen", options->listen,
          "address of this computer, and port; port 0: a free one. Off the loopback it needs --cert, "
          "--key and users")
      ->capture_default_str();
  command->add_option(
      "--page", options->page,
      "folder of the page's files. Without it, the page that was built or installed with this program");
  command->add_option("--programs", options->programs, "folder of the programs that pages load by name");
  command->add_option("--key-file", options->key_file,
                      "file of the page's key, which only this user may read (mode 0600). Without it, a new "
                      "key is made and printed");
  command->add_option("--page-of", options->others,
                      "NAME=ADDRESS: where another machine has its page, for the view of all machines");
  command->add_option("--remote", options->remote,
                      "key file: the daemon is on another computer, and commands go through its gateway, "
                      "signed with this key");
  add_tls(*command, *options);
  add_panel_user(*command);
  command->footer(
      "On this computer:   trunnion panel --machine mill.toml\n"
      "For others as well: trunnion panel user add anna --role operate\n"
      "                    trunnion panel --machine mill.toml --listen 0.0.0.0:8470 --cert mill.crt --key "
      "mill.key\n"
      "Exit codes: 0 ended by Ctrl-C, 3 bad config, 4 the place or a file cannot be used, 5 usage.");
  command->callback([command, options, &exit] {
    if (command->get_subcommands().empty()) exit = serve(*options);
  });
}

}  // namespace trn
