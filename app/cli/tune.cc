#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <iostream>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "app/cli/client_line.h"
#include "app/cli/client_session.h"
#include "app/cli/commands.h"
#include "app/cli/named_files.h"
#include "app/client/access_config.h"
#include "app/client/command_client.h"
#include "app/client/scope_client.h"
#include "app/lab/text_file.h"
#include "app/lab/tune/tune_bode.h"
#include "app/lab/tune/tune_data.h"
#include "app/lab/tune/tune_fit.h"
#include "app/lab/tune/tune_plan.h"
#include "app/lab/tune/tune_report.h"
#include "app/lab/tune/tune_run.h"
#include "app/session/assembly.h"
#include "core/axes.h"
#include "core/machine.h"
#include "core/units.h"
#include "hal/lcm_link.h"
#include "hal/lcm_messages.h"

namespace trn {

namespace {

using trunnion::acknowledge_t;
using trunnion::command_t;
using trunnion::status_t;

constexpr double kStrokePatienceS = 60;
constexpr double kSettleS = 0.15;  // behind a stroke

struct TuneOptions {
  std::string joint, machine, write, svg;
  double length = 0, percent = 60, timeout_s = kTimeout_s, cogging = 0;
  bool emulated = false, yes = false, json = false, shake = false;
};

constexpr const char kTuneFooter[] =
    "It says what it will do and asks. The joint goes to and fro by jogs: at even speeds, fast, by short "
    "ways, and "
    "at a\ncreep. Ctrl-C stops it. The drive must tell its torque ('torque = true' and rated_force_N or "
    "rated_torque_Nm).\nExamples:\n"
    "  trunnion tune X --machine configs/cradle_servo.toml --emulated\n"
    "  trunnion tune X --write x.toml --svg x.svg        with the daemon that runs here\n"
    "Exit codes: 0 done, 2 not enough was seen, 3 bad config, 4 fault or no daemon, 5 usage or refused.";

volatile std::sig_atomic_t tune_interrupted = 0;

double display_unit(const Joint& joint) { return joint.kind == JointKind::kRotary ? kRadPerDeg : 1; }

bool agreed(const TuneOptions& options, const TunePlan& plan, const Joint& joint) {
  fmt::print(stderr, "{}", announcement(plan, joint));
  if (options.yes) return true;
  fmt::print(stderr, "Is its way free, and somebody at the emergency stop? Type y to go on: ");
  std::string answer;
  return std::getline(std::cin, answer) && (answer == "y" || answer == "yes");
}

/// A joint of the machine of a daemon: jogged by commands, watched by the scope.
class DaemonBench {
 public:
  DaemonBench(const Machine& machine, std::size_t joint, double timeout_s)
      : machine_(machine),
        joint_(joint),
        commands_(make_client(machine, "", timeout_s)),
        scope_(read_lcm(machine.root, machine.name), read_access(machine.root), timeout_s) {
    const std::string& name = machine.joints[joint].name;
    names_ = {name + ".measured", name + ".following_error", name + ".force"};
    const trunnion::scope_data_t now = scope_.rows(names_, -1);
    if (now.period.empty()) throw std::runtime_error("the daemon has not ticked yet");
    if (!std::isfinite(now.value[2])) throw NoTorque(machine.joints[joint]);
    data_.period_s = now.period_s;
    next_ = now.newest_period + 1;
    stands_ = display_unit(machine.joints[joint]) * now.value[0];
  }
  double stands() const { return stands_; }

  void move(const TuneStroke& stroke, int number) {
    command_t command = command_of(command_t::JOG);
    command.joint = static_cast<std::int32_t>(joint_);
    command.value = stroke.way;
    command.speed = stroke.speed;
    const acknowledge_t answer = commands_.send(command);
    if (answer.outcome != acknowledge_t::ACCEPTED) throw std::runtime_error(answer.message);
    const auto rests = [&](const status_t& now) {
      return now.count >= answer.status_count && now.state != "jogging";
    };
    const auto status = commands_.wait_status(rests, kStrokePatienceS);
    if (!status || status->state != "idle")
      throw std::runtime_error(fmt::format("the joint did not come to its end: the machine is in state {}{}",
                                           status ? status->state : "?",
                                           status ? " " + status->message : ""));
    fetch(number, kSettleS);
  }
  void stop() { commands_.send(command_of(command_t::STOP)); }
  TuneData take() {
    if (lost_ > 0)
      throw std::runtime_error(
          fmt::format("{} periods were lost on the way; try again, or give [scope] more seconds", lost_));
    return std::move(data_);
  }

 private:
  // All that was seen up to now, and a moment more.
  void fetch(int stroke, double settle_s) {
    const double unit = display_unit(machine_.joints[joint_]);
    std::int64_t end = -1;
    while (end < 0 || next_ < end) {
      const trunnion::scope_data_t rows = scope_.rows(names_, next_);
      if (end < 0) end = rows.newest_period + std::llround(settle_s / data_.period_s);
      for (std::size_t row = 0; row < rows.period.size(); ++row) {
        lost_ += static_cast<std::uint64_t>(rows.period[row] - next_);
        next_ = rows.period[row] + 1;
        const double* value = rows.value.data() + row * names_.size();
        data_.measured.push_back(unit * value[0]);
        data_.setpoint.push_back(unit * (value[0] + value[1]));
        data_.force.push_back(value[2]);
        data_.stroke.push_back(stroke);
      }
    }
  }

  const Machine& machine_;
  std::size_t joint_;
  CommandClient commands_;
  ScopeClient scope_;
  std::vector<std::string> names_;
  TuneData data_;
  std::int64_t next_ = 0;
  std::uint64_t lost_ = 0;
  double stands_ = 0;
};

/// Ctrl-C stops the joint and ends the measurement.
class TuneInterrupt {
 public:
  TuneInterrupt() : before_(std::signal(SIGINT, [](int) { tune_interrupted = 1; })) {}
  ~TuneInterrupt() { std::signal(SIGINT, before_); }
  TuneInterrupt(const TuneInterrupt&) = delete;
  TuneInterrupt& operator=(const TuneInterrupt&) = delete;

 private:
  void (*before_)(int);
};

TuneData move_by_daemon(const TunePlan& plan, DaemonBench& bench) {
  const TuneInterrupt guard;
  for (std::size_t i = 0; i < plan.strokes.size(); ++i) {
    if (tune_interrupted) {
      bench.stop();
      throw std::runtime_error("stopped by Ctrl-C; nothing was reckoned");
    }
    if (isatty(STDERR_FILENO)) fmt::print(stderr, "\r  {} of {} strokes", i + 1, plan.strokes.size());
    bench.move(plan.strokes[i], static_cast<int>(i));
  }
  if (isatty(STDERR_FILENO)) fmt::print(stderr, "\r\033[K");
  return bench.take();
}

Exit tell_tuning(const TuneOptions& options, const TuneData& data, const Joint& joint,
                 std::size_t first_slow) {
  TuneResult result;
  try {
    result.fit = fit_joint(data, joint, display_unit(joint) * options.cogging);
  } catch (const std::runtime_error& error) {
    fmt::print(stderr, "{}\n", error.what());
    return Exit::kBadProgram;
  }
  result.lost_motion = lost_motion(data, result.fit, first_slow);
  result.loop = measure_loop(data, result.fit, joint);
  fmt::print("{}", options.json ? tune_json(result, joint) : tune_text(result, joint));
  if (!options.svg.empty()) write_text_file(options.svg, bode_svg(result.loop, joint));
  const std::string section = tune_config(result, joint);
  if (!options.write.empty())
    write_text_file(options.write, section);
  else if (!options.json)
    fmt::print("For the config, under [feed_forward]:\n\n{}", section);
  return Exit::kDone;
}

std::size_t joint_of(const Machine& machine, const std::string& name) {
  return static_cast<std::size_t>(joint_index(machine, name));
}

Exit tune(const TuneOptions& options) {
  check_text_file(options.svg);
  check_text_file(options.write);
  TuneWish wish;
  wish.speed_share = options.percent / 100;
  TunePlan plan;
  bool go = true;
  const auto plan_of = [&](const Joint& joint, double stands) {
    wish.length = display_unit(joint) * options.length;
    wish.cogging_pitch = display_unit(joint) * options.cogging;
    wish.stirs = options.shake;
    try {
      plan = plan_tuning(joint, stands, wish);
    } catch (const std::runtime_error& error) {
      throw CLI::ValidationError("--length", error.what());
    }
    go = agreed(options, plan, joint);
    return go ? plan : TunePlan{};
  };
  if (options.shake && !options.emulated)
    throw CLI::ValidationError("--shake",
                               "a daemon tells its drives no torque for others; only --emulated shakes");
  if (options.emulated) {  // a name is no daemon's then
    Assembly assembly = assemble(machine_of_name(options.machine).value_or(options.machine));
    const auto told = assembly.machine.root.table_if("feed_forward");
    if (options.shake && !(told && told->boolean("torque", true)))
      throw CLI::ValidationError("--shake",
                                 "the drives are told no torque (0x60B2); the config needs a section "
                                 "[feed_forward] for that");
    const std::size_t index = joint_of(assembly.machine, options.joint);
    const Joint joint = assembly.machine.joints[index];
    const TuneData data = tune_emulated(assembly, static_cast<int>(index),
                                        [&](double stands) { return plan_of(joint, stands); });
    return go ? tell_tuning(options, data, joint, plan.first_slow) : Exit::kUsage;
  }
  const Machine machine = client_machine(options.machine, "");
  const std::size_t index = joint_of(machine, options.joint);
  const Joint& joint = machine.joints[index];
  const auto told = machine.root.table_if("feed_forward");
  if (told && told->boolean("velocity", true))
    fmt::print(
        stderr,
        "The daemon tells its drives speeds in advance, so that the mass may come out too small: have the "
        "daemon run\nwith 'velocity = false' in [feed_forward] for this measurement.\n");
  DaemonBench bench(machine, index, options.timeout_s);
  plan_of(joint, bench.stands());
  return go ? tell_tuning(options, move_by_daemon(plan, bench), joint, plan.first_slow) : Exit::kUsage;
}

}  // namespace

void add_tune(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<TuneOptions>();
  CLI::App* command = app.add_subcommand(
      "tune",
      "Move a joint, and find its mass, friction, weight, play and resonance for feed-forward and jerk");
  command->add_option("joint", options->joint, "the joint, as X")->required();
  command
      ->add_option(
          "--length", options->length,
          "how far it goes at most from where it stands, mm or degrees; default: what its speed needs")
      ->check(CLI::PositiveNumber);
  command->add_option("--speed", options->percent, "how fast at most, percent of the joint's velocity")
      ->check(CLI::Range(5, 100))
      ->capture_default_str();
  command->add_option("--write", options->write, "write the joint's table for the config into this file");
  command->add_option("--svg", options->svg, "draw the frequency responses (Bode)");
  command
      ->add_option("--cogging", options->cogging,
                   "fit a table of the motor's cogging, too: the way after which it repeats, mm or degrees")
      ->check(CLI::PositiveNumber);
  command->add_flag(
      "--shake", options->shake,
      "with --emulated: shake the motor by a small torque as well, which shows resonances above 50 Hz");
  command->add_flag("--emulated", options->emulated,
                    "rehearse: on the drives that the config emulates, in this process; nothing moves");
  command->add_flag("--yes", options->yes, "do not ask");
  command->add_flag("--json", options->json, "the result as JSON");
  command->add_option("--machine,-m", options->machine, kMachineHelp)->envname("TRUNNION_MACHINE");
  add_timeout(*command, options->timeout_s);
  command->footer(kTuneFooter);
  command->callback([options, &exit] {
    try {
      exit = tune(*options);
    } catch (const NoTorque& error) {
      fmt::print(stderr, "{}\n", error.what());
      exit = Exit::kBadProgram;
    }
  });
}

}  // namespace trn
