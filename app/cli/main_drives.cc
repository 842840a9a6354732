#include <fmt/format.h>
#include <poll.h>
#include <sched.h>
#include <signal.h>
#include <sys/mman.h>
#include <sys/signalfd.h>
#include <time.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <exception>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "app/cli/help_formatter.h"
#include "app/cli/man_page.h"
#include "app/cli/named_files.h"
#include "app/cli/version.h"
#include "core/config.h"
#include "core/machine.h"
#include "hal/can/bus.h"
#include "hal/can/can_config.h"
#include "hal/can/frame.h"
#include "hal/can/socket_can.h"
#include "hal/modbus/field_devices.h"
#include "hal/modbus/modbus_drives.h"
#include "hal/modbus/modbus_io.h"
#include "sim/canopen/emulated_can.h"
#include "sim/canopen/emulated_node.h"
#include "sim/canopen/emulated_probe.h"
#include "sim/canopen/fault_script.h"
#include "sim/modbus/emulated_cabinet.h"
#include "sim/modbus/emulated_positioner.h"

// The field of a machine as a program of its own: emulated CANopen nodes on real CAN interfaces, emulated
// Modbus devices on TCP ports and pseudo-terminals.
namespace trn {
namespace {

constexpr std::int64_t kCabinetStep = 10'000'000;  // ns

struct Options {
  std::string machine, faults, trace;
  std::vector<std::string> interfaces;
  std::vector<int> without;
  int priority = 0;
};

constexpr std::int64_t kTraceStep = 2'000'000;  // ns

/// One interface and the nodes that live on it.
struct Line {
  std::string interface;
  std::unique_ptr<SocketCan> socket;
  std::vector<std::unique_ptr<EmulatedNode>> nodes;
  std::vector<CanFrame> unsent;
};

struct CanField {
  std::vector<Line> lines;
  std::unique_ptr<EmulatedProbe> probe;
};

void send_all(Line& line, std::int64_t now_ns) {
  CanFrame frame;
  for (auto& node : line.nodes)
    while (node->next_frame(now_ns, frame)) line.unsent.push_back(frame);
  const int taken = line.socket->send(line.unsent);
  line.unsent.erase(line.unsent.begin(), line.unsent.begin() + taken);
  if (line.unsent.size() > 1000) line.unsent.clear();  // the interface has been gone for long
}

void serve(Line& line, std::int64_t now_ns) {
  std::array<CanFrame, 64> in;
  for (int count = 64; count == 64;) {
    count = line.socket->receive(in);
    for (int i = 0; i < count; ++i) {
      // after each frame, so that an answer does not wait for those behind it
      for (auto& node : line.nodes) node->receive(in[static_cast<std::size_t>(i)], now_ns);
      send_all(line, now_ns);
    }
  }
  for (auto& node : line.nodes) node->poll(now_ns);
  send_all(line, now_ns);
}

bool is_left_out(const Options& options, int id) {
  return std::find(options.without.begin(), options.without.end(), id) != options.without.end();
}

std::string drives_type(const Machine& machine) {
  return machine.root.table("drives").choice("type",
                                             {"loopback", "simulated", "canopen", "modbus", "micro_mill"});
}

std::unique_ptr<EmulatedCabinet> make_cabinet(const Machine& machine) {
  const ModbusIoConfig config = read_modbus_io(machine.root);
  if (config.devices.devices.empty()) return nullptr;
  for (const ModbusConfig::Line& line : config.devices.lines)
    fmt::print("{}: {}\n", line.name, line.address.text());
  return std::make_unique<EmulatedCabinet>(config, read_emulated_values(machine.root, config.devices));
}

std::unique_ptr<EmulatedPositioners> make_positioners(const Machine& machine) {
  if (drives_type(machine) != "modbus") return nullptr;
  const ConfigTable section = machine.root.table("drives");
  const ModbusDrivesConfig config = read_modbus_drives(machine, section);
  for (const ModbusConfig::Line& line : config.lines)
    fmt::print("{}: {}, drives\n", line.name, line.address.text());
  return std::make_unique<EmulatedPositioners>(machine, config, section);
}

CanField make_field(const Options& options, const Machine& machine) {
  if (drives_type(machine) != "canopen") return {};
  const ConfigTable section = machine.root.table("drives");
  const CanDrivesConfig config = read_can_drives(machine, section);
  auto nodes = make_emulated_nodes(machine, config, section);
  if (!options.interfaces.empty() && options.interfaces.size() != nodes.size())
    throw std::runtime_error(
        fmt::format("the machine has {} buses; name as many interfaces with --can", nodes.size()));
  CanField field{{}, std::make_unique<EmulatedProbe>(machine, section)};
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    const std::string name = options.interfaces.empty() ? config.buses[i].interface : options.interfaces[i];
    std::erase_if(nodes[i], [&](const auto& node) { return is_left_out(options, node->id()); });
    for (auto& node : nodes[i]) {
      node->no_answer_delay();
      field.probe->wire(*node, config.joint_of(i, node->id()));
    }
    field.lines.push_back(
        {name, std::make_unique<SocketCan>(name, std::vector<CanFilter>{}), std::move(nodes[i]), {}});
    if (config.buses[i].fd && !field.lines.back().socket->carries_fd())
      throw std::runtime_error(
          fmt::format("{0}: no CAN FD here; ip link set {0} mtu 72 (virtual), or ip link set {0} "
                      "type can bitrate .. dbitrate .. fd on",
                      name));
    fmt::print("{}: {} drives\n", name, field.lines.back().nodes.size());
  }
  return field;
}

/// What the drives do, whoever commands them or not: position (counts) and statusword of each, as CSV, one
/// row each time that one of them changed. Times are those of CLOCK_MONOTONIC, so that another process can
/// lay its own beside them.
class DriveTrace {
 public:
  DriveTrace(const std::string& path, std::vector<Line>& lines) : lines_(lines), path_(path) {
    file_.reset(std::fopen(path.c_str(), "we"));
    if (!file_) throw std::runtime_error(fmt::format("{}: {}", path, std::strerror(errno)));
    std::string head = "time_s";
    for (const Line& line : lines_)
      for (const auto& node : line.nodes)
        head += fmt::format(",{0}.{1}.counts,{0}.{1}.status", line.interface, node->id());
    write(head);
  }

  void step(std::int64_t now_ns) {
    if (now_ns < next_ns_) return;
    next_ns_ = now_ns + kTraceStep;
    std::string row;
    for (Line& line : lines_)
      for (auto& node : line.nodes)
        row += fmt::format(",{},0x{:04x}", node->store().integer({0x6064, 0}),
                           node->store().integer({0x6041, 0}));
    if (row == last_) return;
    write(fmt::format("{:.4f}{}", 1e-9 * static_cast<double>(now_ns), row));
    last_ = std::move(row);
  }

 private:
  void write(const std::string& row) {
    if (std::fprintf(file_.get(), "%s\n", row.c_str()) < 0 || std::fflush(file_.get()) != 0)
      throw std::runtime_error(fmt::format("{}: {}", path_, std::strerror(errno)));
  }

  std::vector<Line>& lines_;
  std::string path_, last_;
  std::unique_ptr<std::FILE, int (*)(std::FILE*)> file_{nullptr, &std::fclose};
  std::int64_t next_ns_ = 0;
};

std::int64_t monotonic_ns() {
  timespec now;
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1'000'000'000LL + now.tv_nsec;
}

int termination_fd() {
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, SIGTERM);
  sigaddset(&set, SIGINT);
  sigprocmask(SIG_BLOCK, &set, nullptr);
  return signalfd(-1, &set, SFD_NONBLOCK | SFD_CLOEXEC);
}

void make_realtime(int priority) {
  if (priority == 0) return;
  const sched_param wish{priority};
  if (sched_setscheduler(0, SCHED_FIFO, &wish) != 0 || mlockall(MCL_CURRENT | MCL_FUTURE) != 0)
    fmt::print(stderr, "no real-time priority; the drives answer late under load\n");
}

void run(const Options& options) {
  const Machine machine = read_machine(load_config(options.machine));
  FaultScript script;
  if (!options.faults.empty()) script = read_fault_script(options.faults);
  CanField field = make_field(options, machine);
  std::vector<Line>& lines = field.lines;
  const int stop = termination_fd();  // before threads: they inherit what is blocked
  const std::unique_ptr<EmulatedCabinet> cabinet = make_cabinet(machine);
  const std::unique_ptr<EmulatedPositioners> positioners = make_positioners(machine);
  if (lines.empty() && !cabinet && !positioners)
    throw machine.root.table("drives").error(
        "type",
        "nothing to emulate: the drives are neither on CAN ('type' = \"canopen\") nor on Modbus "
        "(\"modbus\"), and there is no [modbus]");
  if (!options.trace.empty() && lines.empty())
    throw machine.root.table("drives").error("type", "--trace is of drives on CAN ('type' = \"canopen\")");
  std::optional<DriveTrace> trace;
  if (!options.trace.empty()) trace.emplace(options.trace, lines);
  std::fflush(stdout);
  make_realtime(options.priority);
  std::vector<pollfd> waiting = {{stop, POLLIN, 0}};
  for (const Line& line : lines) waiting.push_back({line.socket->fd(), POLLIN, 0});
  const std::int64_t begin_ns = monotonic_ns();
  std::int64_t cabinet_ns = begin_ns, positioners_ns = begin_ns;
  const timespec slice{0, lines.empty() && !positioners ? 10'000'000 : 500'000};
  while (!(waiting[0].revents & POLLIN)) {
    const std::int64_t now_ns = monotonic_ns();
    if (cabinet && now_ns - cabinet_ns >= kCabinetStep) {
      script.run(*cabinet, now_ns - begin_ns);
      cabinet->step(1e-9 * static_cast<double>(now_ns - cabinet_ns));
      cabinet_ns = now_ns;
    }
    if (positioners)
      positioners->step(1e-9 * static_cast<double>(now_ns - std::exchange(positioners_ns, now_ns)));
    for (std::size_t i = 0; i < lines.size(); ++i) {
      script.run(lines[i].nodes, i, now_ns - begin_ns, now_ns);
      serve(lines[i], now_ns);
      if (lines[i].socket->state() == BusState::kDown) lines[i].socket->recover();
    }
    if (field.probe) field.probe->step();
    if (trace) trace->step(now_ns);
    ppoll(waiting.data(), waiting.size(), &slice, nullptr);
  }
  close(stop);
}

}  // namespace
}  // namespace trn

int main(int argc, char** argv) {
  CLI::App app{
      "Emulated CiA 402 drives on real CAN interfaces, and the Modbus devices of the same config on TCP "
      "ports\n"
      "and pseudo-terminals, for rehearsals without a machine.\n"
      "Example: ip link add dev vcan0 type vcan; ip link set vcan0 up\n"
      "         trunnion-drives --can vcan0 --machine cradle_can",
      "trunnion-drives"};
  app.set_version_flag("--version", trn::version_text("trunnion-drives"), "Print version and commit");
  app.formatter(std::make_shared<trn::HelpFormatter>());
  app.add_flag_callback("--man",
                        [&app] {
                          fmt::print("{}", trn::man_page(app));
                          throw CLI::Success();
                        })
      ->group("");  // for the packages
  trn::Options options;
  app.add_option("--machine,-m", options.machine, trn::kMachineOption)->required();
  app.add_option("--can", options.interfaces,
                 "Interfaces, one for each bus of the config, instead of those it names");
  app.add_option("--faults", options.faults,
                 "Script of what goes wrong and when (TOML, [[fault]]: at_s, node, kind, value)");
  app.add_option(
      "--trace", options.trace,
      "Write position and statusword of every drive here (CSV), a row whenever one changed; it shows what "
      "the drives do when nobody commands them any more");
  app.add_option("--without", options.without, "Node ids that somebody else plays");
  app.add_option("--priority", options.priority, "SCHED_FIFO priority; 0: none")->check(CLI::Range(0, 98));
  app.footer("Exit codes: 0 ended by a signal, 3 bad config or script, 4 no such interface, 5 usage.");
  trn::take_machine_names(app);
  try {
    app.parse(argc, argv);
    trn::run(options);
    return 0;
  } catch (const CLI::ParseError& error) {
    return app.exit(error) == 0 ? 0 : 5;
  } catch (const trn::ConfigError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 3;
  } catch (const std::exception& error) {
    fmt::print(stderr, "trunnion-drives: {}\n", error.what());
    return 4;
  }
}
