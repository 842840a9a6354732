#include "app/lab/commission/commission.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <chrono>
#include <cstdint>
#include <iostream>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "app/cli/commands.h"
#include "app/cli/named_files.h"
#include "app/daemon/realtime.h"
#include "app/daemon/tick_thread.h"
#include "app/lab/commission/commission_machine.h"
#include "app/lab/commission/emulated_commission.h"
#include "app/lab/text_file.h"
#include "app/session/make_cycle.h"
#include "hal/can/can_config.h"
#include "hal/can/nmt.h"
#include "hal/can/sdo_talk.h"
#include "hal/can/socket_can.h"
#include "kernel/cycle.h"
#include "kernel/rt_messages.h"

namespace trn {

namespace {

struct CommissionOptions {
  std::string machine, truth, record, protocol;
};

constexpr const char kCommissionFooter[] =
    "A check-list for the first day of a machine: figures, drives on the bus, counts by a ruler, direction "
    "of\n"
    "every program word, switches, homing, ranges, brakes, following error, tuning, spindle, probe, latency. "
    "It asks, "
    "moves "
    "the\n"
    "machine slowly, and writes what it finds into the config; CONFIG.before keeps what was there. Answer q "
    "to\n"
    "leave; the next call goes on there. Keep a hand on the emergency stop, and nobody near the machine.\n"
    "  trunnion commission --machine configs/mine.toml --protocol mine.md\n"
    "Rehearse it first: another config says how emulated drives are really built and wired.\n"
    "  trunnion commission --machine wrong.toml --rehearse truth.toml\n"
    "Exit: 0 all is done, 3 bad config, 4 an item failed or is not done, 5 usage.\n";

/// The person has left: the list goes on there another time.
struct LeftTheList : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// Why the config is not one to write into; empty: it is. A machine that comes with Trunnion is copied first.
std::string a_config_of_ones_own(const std::string& file) {
  const std::string no_file = CLI::ExistingFile(file);
  const auto named = no_file.empty() ? std::nullopt : machine_of_name(file);
  if (!named) return no_file;
  return fmt::format(
      "what is found is written into the config, so copy it, with the files that it names, and "
      "give the copy: cp {} {}.toml",
      *named, file);
}

/// The real drives, ticked in real time; a daemon of the machine must not run beside it.
class RealCommission final : public CommissionMachine {
 public:
  RealCommission(const std::string& config, bool feed_forward)
      : CommissionMachine(assemble(config, Field::kReal)) {
    if (!feed_forward) assembly_.feed_forward.reset();
    cycle_.reset(new Cycle(make_cycle(assembly_, queue_, ProgramStops::kPass)));
    if (assembly_.io) assembly_.io->bring_up();
    thread_ = std::make_unique<TickThread>(assembly_.realtime, assembly_.machine.period_s,
                                           [this](int, const LoopStatistics&) { cycle_->tick(); });
    for (const std::string& refused : thread_->refused()) fmt::print(stderr, "NOT REAL TIME: {}\n", refused);
  }
  ~RealCommission() override {
    assembly_.drives->shut_down();
    wait(1);
    thread_.reset();
  }
  // Reports are taken meanwhile: the ring between the threads holds some periods only.
  void wait(double time_s) override {
    using Clock = std::chrono::steady_clock;
    const auto end =
        Clock::now() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(time_s));
    while (Clock::now() < end) {
      std::this_thread::sleep_until(std::min(end, Clock::now() + std::chrono::milliseconds(2)));
      report();
    }
  }
  CycleReport report() override {
    while (cycle_->next_report(last_))
      if (watcher_) watcher_(last_);
    return last_;
  }
  double latest_us(double time_s) override {
    wait(time_s);
    return thread_->statistics().wake.max_us() + thread_->statistics().tick.max_us();
  }
  const char* clock() const override { return "as this computer has been since the list began"; }
  bool rehearses() const override { return false; }
  std::vector<ScannedBus> scan() override {
    constexpr std::int64_t kAnswer_ns = 30'000'000;
    std::vector<ScannedBus> out;
    const CanDrivesConfig config = read_can_drives(assembly_.machine, assembly_.machine.root.table("drives"));
    for (const CanBusConfig& bus : config.buses) {
      SocketCan endpoint(bus.interface, {{cob::kSdoAnswer, 0x780}});
      out.push_back({bus.interface, scan_nodes(endpoint, kNodeIdMax, kAnswer_ns)});
    }
    return out;
  }

 private:
  CycleReport last_;
  std::unique_ptr<TickThread> thread_;
};

class TerminalOperator final : public CommissionOperator {
 public:
  bool agrees(const std::string& text) override {
    return asked(text + "\n  Enter: go on; n: no; q: leave", [](const std::string& line, bool& yes) {
      yes = line.empty() || line == "y" || line == "yes";
      return yes || line == "n" || line == "no";
    });
  }
  double measured(const std::string& text, int) override {
    double value = 0;
    asked(text + "\n  a number; q: leave", [&](const std::string& line, bool&) {
      const auto [end, error] = std::from_chars(line.data(), line.data() + line.size(), value);
      return error == std::errc() && end == line.data() + line.size() && value >= 0;
    });
    return value;
  }
  bool went_positive(const std::string& text, int) override {
    return asked(text + "\n  y: yes; n: no; q: leave", [](const std::string& line, bool& yes) {
      yes = line == "y" || line == "yes";
      return yes || line == "n" || line == "no";
    });
  }
  bool turned_clockwise(const std::string& text) override { return went_positive(text, 0); }
  bool does(const std::string& text, HandStep, int) override { return agrees(text); }
  void lets_go(const std::string& text) override { fmt::print("{}\n", text); }
  void tell(const std::string& text) override { fmt::print("{}\n", text); }

 private:
  template <typename Understand>
  bool asked(const std::string& text, Understand understand) {
    fmt::print("{}\n", text);
    for (bool yes = false;;) {
      fmt::print("> ");
      std::fflush(stdout);
      std::string line;
      if (!std::getline(std::cin, line) || line == "q")
        throw LeftTheList("left; the same command goes on here");
      if (understand(line, yes)) return yes;
      fmt::print("'{}' is none of these\n", line);
    }
  }
};

Exit commission(const CommissionOptions& options) {
  std::unique_ptr<CommissionMachine> machine;
  std::unique_ptr<CommissionOperator> person;
  Commission::MakeMachine make;
  if (options.truth.empty()) {
    person = std::make_unique<TerminalOperator>();
    make = [&](bool feed_forward) { return std::make_unique<RealCommission>(options.machine, feed_forward); };
  } else {
    person = std::make_unique<RehearsedOperator>(machine,
                                                 [](const std::string& text) { fmt::print("{}\n", text); });
    make = [&](bool feed_forward) {
      return std::make_unique<EmulatedCommission>(options.machine, options.truth, feed_forward);
    };
  }
  const std::string record = options.record.empty() ? options.machine + ".commission.json" : options.record;
  for (const std::string& path : {options.machine, options.protocol, record}) check_text_file(path);
  Commission list({options.machine, record}, make, machine, *person);
  bool done = false;
  try {
    done = list.run();
  } catch (const LeftTheList& left) {
    fmt::print("{}\n", left.what());
  }
  if (!options.protocol.empty()) write_text_file(options.protocol, list.protocol());
  fmt::print("\n{}", list.protocol());
  return done ? Exit::kDone : Exit::kMachineFault;
}

}  // namespace

void add_commission(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<CommissionOptions>();
  CLI::App* command = app.add_subcommand("commission", "Go through the first day of a machine, item by item");
  command
      ->add_option("--machine,-m", options->machine,
                   "config of the machine; it is written as the list goes on")
      ->required()
      ->check(a_config_of_ones_own);
  command
      ->add_option("--rehearse", options->truth,
                   "do it with emulated drives that are built and wired as this config says, and answer by "
                   "what they do")
      ->check(CLI::ExistingFile);
  command->add_option(
      "--record", options->record,
      "what is done already, to go on there; default: the config's name and .commission.json");
  command->add_option("--protocol", options->protocol,
                      "write the list with its results into this file (Markdown)");
  command->footer(kCommissionFooter);
  command->callback([options, &exit] { exit = commission(*options); });
}

}  // namespace trn
