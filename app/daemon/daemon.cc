#include "app/daemon/daemon.h"

#include <fmt/format.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>
#include <systemd/sd-daemon.h>
#include <unistd.h>

#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <optional>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "app/client/command_rights.h"
#include "app/client/daemon_place.h"
#include "app/daemon/access.h"
#include "app/daemon/drop_teller.h"
#include "app/daemon/machine_controller.h"
#include "app/daemon/scope_server.h"
#include "app/daemon/sensor_receiver.h"
#include "app/daemon/tick_thread.h"
#include "app/session/feature_meter.h"
#include "app/session/feature_report.h"
#include "app/session/plausibility.h"
#include "app/session/signals.h"
#include "core/fault.h"
#include "hal/lcm_link.h"
#include "hal/local_socket.h"

namespace trn {

namespace {

constexpr int kPollMs = 5;
constexpr int kExitMachineFault = 4;
constexpr int kLastWaits = 100;
constexpr auto kLastWait = std::chrono::milliseconds(10);
constexpr int kRoundsAtOnce = 8;  // a flood must not keep the daemon from its other work

std::vector<std::string> collect_warnings(const RealtimeConfig& config, const std::string& memory_refused,
                                          const TickThread& thread, bool late_is_fault) {
  std::vector<std::string> warnings = thread.refused();
  if (!memory_refused.empty()) warnings.push_back(memory_refused);
  if (config.priority == 0)
    warnings.emplace_back("no real-time priority: realtime.priority is 0; the tick may be late");
  for (const std::string& warning : warnings) spdlog::warn("NOT REAL TIME: {}", warning);
  if (!warnings.empty() && !late_is_fault)
    spdlog::warn(
        "NOT REAL TIME: late periods are counted and are no fault here (realtime.late_periods_max); the "
        "motion runs slower than on a machine");
  return warnings;
}

/// Tells the service manager, if one asked, that the daemon is up and that the tick is alive.
class ServiceNotifier {
 public:
  ServiceNotifier() { watched_ = sd_watchdog_enabled(0, &watchdog_us_) > 0; }
  void ready() { sd_notify(0, "READY=1\nSTATUS=running"); }
  void stopping() { sd_notify(0, "STOPPING=1"); }
  void alive(std::uint64_t periods) {
    const auto now = std::chrono::steady_clock::now();
    if (!watched_ || periods == last_periods_ || now - last_ < std::chrono::microseconds(watchdog_us_ / 3))
      return;
    last_periods_ = periods;
    last_ = now;
    sd_notify(0, "WATCHDOG=1");
  }

 private:
  std::uint64_t watchdog_us_ = 0, last_periods_ = 0;
  std::chrono::steady_clock::time_point last_;
  bool watched_ = false;
};

// A program has ended.
void tell_features(const DaemonParts& parts) {
  const std::vector<FeatureDeflection> features = parts.features->last();
  if (parts.log) parts.log->features(features);
  spdlog::info("{}", features_text(features));
}

void drain_reports(const DaemonParts& parts, MachineController& controller, ScopeServer& scope) {
  CycleReport report;
  while (parts.tick.next_report(report)) {
    if (report.lost_reports != controller.last_report().lost_reports)
      spdlog::error("{} periods were not seen in time: they are missing in every record of this session",
                    report.lost_reports - controller.last_report().lost_reports);
    // without power the setpoint only follows the drives
    if (parts.record && report.drives == DriveState::kEnabled) parts.record->write(report);
    if (parts.record && report.drives != DriveState::kEnabled) parts.record->power_lost();
    if (parts.log) parts.log->report(report);
    if (parts.on_report) parts.on_report(report);
    scope.report(report);
    if (parts.features) parts.programs.hand_on_moves();
    if (parts.features && parts.features->report(report)) tell_features(parts);
    controller.report(report);
  }
}

// Who hangs in a system call cannot be waited for: then the process ends from here.
void end_with(const MachineController& controller) {
  const std::string bad = controller.bad_ending();
  for (int i = 0; i < kLastWaits && controller.hangs(); ++i) std::this_thread::sleep_for(kLastWait);
  if (bad.empty() && !controller.hangs()) return spdlog::info("ended in good order");
  const std::string text =
      fmt::format("NOT ended in good order: {}", bad.empty() ? "a program or a drive does not answer" : bad);
  if (!controller.hangs()) throw std::runtime_error(text);
  spdlog::critical("{}", text);
  std::fflush(nullptr);
  std::_Exit(kExitMachineFault);
}

void serve(const DaemonParts& parts, LocalServer& clients, const TickThread& thread,
           TerminationSignals& signals, MachineController& controller, ScopeServer& scope) {
  ServiceNotifier notifier;
  DropTeller drops;
  controller.begin();
  notifier.ready();
  while (!controller.done()) {
    for (int round = 0; round < kRoundsAtOnce && clients.handle(round == 0 ? kPollMs : 0);) ++round;
    if (const std::string told = drops.look(clients.dropped(), std::chrono::steady_clock::now());
        !told.empty())
      spdlog::warn("{}", told);
    if (LocalServer* safety = parts.door.safety()) safety->handle(0);
    if (const std::string trouble = parts.door.look(std::chrono::steady_clock::now()); !trouble.empty())
      controller.tell_trouble("socket", trouble, "no new client can command this daemon");
    if (const std::string trouble = parts.log ? parts.log->take_trouble() : ""; !trouble.empty())
      controller.tell_trouble("session_log", trouble, "the session's log is not whole");
    for (const auto& work : parts.background) work();
    drain_reports(parts, controller, scope);
    if (signals.taken()) {
      spdlog::info("told to end: motion, drives, process");
      notifier.stopping();
      controller.terminate();
    }
    controller.poll();
    notifier.alive(thread.statistics().periods);
    if (thread.failed()) throw std::runtime_error("the clock of the tick failed; the drives were left alone");
  }
  drain_reports(parts, controller, scope);
}

// Telemetry is for whoever likes to listen; a machine runs without.
LcmPublisher make_telemetry(const std::string& url) {
  const std::string bad = url.empty() ? "" : lcm_self_test(url);
  if (!bad.empty()) spdlog::warn("no telemetry over LCM; clients work without it: {}", bad);
  return LcmPublisher(bad.empty() ? url : "");
}

}  // namespace

void log_to_stderr() {
  if (!spdlog::get("trunnion")) spdlog::set_default_logger(spdlog::stderr_logger_mt("trunnion"));
  spdlog::flush_on(spdlog::level::info);
}

void run_daemon(const DaemonParts& parts) {
  log_to_stderr();
  give_back_large_blocks();
  TerminationSignals signals;  // first: threads inherit what is blocked
  LocalServer& clients = parts.door.clients();
  const AccessRules& access = parts.door.access();
  LcmPublisher telemetry = make_telemetry(parts.lcm.url);
  const std::string memory_refused = parts.realtime.lock_memory ? lock_memory() : "";
  const int late_max = parts.realtime.late_periods(parts.drives.real());
  parts.rate_plans.start(parts.realtime);
  TickThread thread(parts.realtime, parts.machine.period_s,
                    [&tick = parts.tick, late_max](int late_periods, const LoopStatistics& loop) {
                      if (late_max > 0 && late_periods > late_max) tick.latch(Fault::kCycleOverrun);
                      tick.tell_times(1e-3 * static_cast<double>(loop.wake_now_ns),
                                      1e-3 * static_cast<double>(loop.tick_before_ns));
                      tick.tick();
                    });
  MachineController controller({parts.machine,
                                parts.lcm,
                                clients,
                                access,
                                telemetry,
                                parts.drives,
                                parts.tick,
                                parts.programs,
                                thread.statistics(),
                                parts.log,
                                parts.map,
                                parts.chain,
                                parts.io,
                                parts.features,
                                parts.kinematics,
                                parts.plan_joints,
                                parts.version,
                                parts.counters_file,
                                parts.place,
                                parts.door.safety()},
                               collect_warnings(parts.realtime, memory_refused, thread, late_max > 0));
  if (parts.kinematics)
    for (const std::string& question : implausible(parts.machine, *parts.kinematics))
      spdlog::warn("is this right? {}", question);
  spdlog::info("machine '{}', period {:g} ms, socket {}", parts.machine.name, 1000 * parts.machine.period_s,
               clients.path());
  std::optional<SensorReceiver> receiver;
  if (parts.sensors) {
    receiver.emplace(*parts.sensors);
    clients.subscribe<trunnion::sensor_t>(parts.lcm.sensor_channel(), [&](const auto& readings) {
      const Peer* sender = clients.peer(clients.sender());
      if (sender) receiver->receive(readings, access.allows(*sender, Role::kOperate) ? "" : sender->text());
    });
  }
  const SignalTable signals_of_machine(parts.machine, parts.chain, parts.drives.feedback_periods());
  ScopeServer scope(clients, access, parts.lcm, parts.machine, signals_of_machine, parts.scope,
                    parts.log_file);
  serve(parts, clients, thread, signals, controller, scope);
  if (const std::string health = parts.drives.health(); !health.empty()) spdlog::info("{}", health);
  end_with(controller);
}

}  // namespace trn
