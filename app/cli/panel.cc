#include <atomic>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>

#include "app/cli/commands.h"
#include "app/cli/kinematics_json.h"
#include "app/client/access_config.h"
#include "core/config.h"
#include "core/machine.h"
#include "hal/lcm_link.h"
#include "panel/server/panel_config.h"
#include "panel/server/panel_key.h"
#include "panel/server/panel_server.h"
#include "panel/server/web_rules.h"

namespace trn {

namespace {

std::atomic<bool> stop_asked = false;

struct PanelOptions {
  std::string machine, listen = "127.0.0.1:8470", page, programs, key_file;
};

std::string own_folder(const std::string& machine) {
  const char* state = std::getenv("STATE_DIRECTORY");
  const char* home = std::getenv("HOME");
  const std::string base =
      state ? std::string(state) : std::string(home ? home : "") + "/.local/state/trunnion";
  return base + "/panel/" + machine;
}

std::string own_program() {
  std::error_code none;
  return std::filesystem::read_symlink("/proc/self/exe", none);
}

// The page that was built or installed with this program.
std::string find_page(const std::string& named) {
  namespace fs = std::filesystem;
  std::error_code none;
  const fs::path here = fs::path(own_program()).parent_path();
  const std::vector<fs::path> places =
      named.empty() ? std::vector<fs::path>{here / "panel", here / "../share/trunnion/panel"}
                    : std::vector<fs::path>{named};
  for (const fs::path& place : places)
    if (fs::is_regular_file(place / "index.html", none)) return place;
  throw std::runtime_error(
      fmt::format("there is no page in {}; install the package trunnion-panel, or build it with "
                  "'panel/build.sh FOLDER' and name the folder with --page",
                  places.front().string()));
}

Exit serve(const PanelOptions& options) {
  Machine machine = read_machine(load_config(options.machine));
  const std::string programs = options.programs.empty() ? own_folder(machine.name) : options.programs;
  std::filesystem::create_directories(programs);
  const LcmConfig lcm = read_lcm(machine.root, machine.name);
  const AccessConfig access = read_access(machine.root);
  const ListenPlace listen = read_listen_place(options.listen);
  // What a unit prints is in the journal, which others may read: the key of a file is not printed.
  const bool once = options.key_file.empty();
  const PanelKey key = once ? PanelKey::make() : PanelKey::read(options.key_file);
  const PanelConfig config{machine,
                           std::filesystem::absolute(options.machine),
                           TRN_VERSION,
                           listen,
                           find_page(options.page),
                           std::filesystem::absolute(programs),
                           lcm,
                           access,
                           key,
                           kinematics_json(machine),
                           own_program(),
                           once};
  struct sigaction action {};
  action.sa_handler = [](int) { stop_asked = true; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  serve_panel(config, stop_asked);
  return Exit::kDone;
}

}  // namespace

void add_panel(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<PanelOptions>();
  CLI::App* command =
      app.add_subcommand("panel", "Serve the operator's page of a daemon's machine to a browser");
  command->add_option("--machine", options->machine, "config of the machine whose daemon runs")
      ->envname("TRUNNION_MACHINE")
      ->required();
  command
      ->add_option("--listen", options->listen,
                   "address of this computer's loopback, and port; port 0: a free one")
      ->capture_default_str();
  command->add_option(
      "--page", options->page,
      "folder of the page's files. Without it, the page that was built or installed with this program");
  command->add_option("--programs", options->programs, "folder of the programs that pages load by name");
  command->add_option("--key-file", options->key_file,
                      "file of the page's key, which only this user may read (mode 0600). Without it, a new "
                      "key is made and printed");
  command->callback([options, &exit] { exit = serve(*options); });
}

}  // namespace trn
