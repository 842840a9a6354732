#include "app/lab/commission/emulated_commission.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <utility>

#include "app/session/make_cycle.h"
#include "app/session/word_directions.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/ports.h"
#include "core/units.h"
#include "hal/can/can_config.h"
#include "hal/can/nmt.h"
#include "hal/can/sdo_talk.h"
#include "kernel/cycle.h"
#include "kinematics/factory.h"
#include "sim/canopen/emulated_drive.h"

namespace trn {

bool CommissionMachine::until(const std::function<bool(const CycleReport&)>& done, double time_s) {
  constexpr double kLook_s = 0.02;
  for (double passed_s = 0; passed_s < time_s; passed_s += kLook_s) {
    if (done(report())) return true;
    wait(kLook_s);
  }
  return done(report());
}

bool CommissionMachine::turn_spindle(double rpm) {
  queue_.begin_generation();
  MotionBlock block;
  block.event.kind = QueueEvent::Kind::kSpindle;
  block.event.value = rpm;
  if (!queue_.push(block)) return false;
  block.event = {};
  block.event.kind = QueueEvent::Kind::kProgramEnd;
  if (!queue_.push(block)) return false;
  post({RtCommand::Kind::kStart, 1});
  return true;
}

/// The devices beside the drives, with a probe that somebody holds.
class EmulatedCommission::HeldIo final : public MachineIo {
 public:
  explicit HeldIo(std::unique_ptr<MachineIo> inner) : inner_(std::move(inner)) {}
  void bring_up() override { inner_->bring_up(); }
  void shut_down() noexcept override { inner_->shut_down(); }
  void exchange(const IoOutputs& outputs, const IoPlace& place, IoInputs& inputs) TRN_RT override {
    inner_->exchange(outputs, place, inputs);
    inputs.probe = inputs.probe || probe_;
  }
  std::string explain_fault() const override { return inner_->explain_fault(); }
  std::string health() const override { return inner_->health(); }
  void hold_probe(bool on) { probe_ = on; }

 private:
  std::unique_ptr<MachineIo> inner_;
  bool probe_ = false;
};

EmulatedCommission::~EmulatedCommission() = default;

EmulatedCommission::EmulatedCommission(const std::string& config, const std::string& truth, bool feed_forward)
    : CommissionMachine(assemble(config, Field::kEmulated)), truth_(read_machine(load_config(truth))) {
  if (drives_type(assembly_.machine) != "canopen" || drives_type(truth_) != "canopen")
    throw std::runtime_error("the drives of this machine are on no CAN bus: nothing to rehearse");
  if (!feed_forward) assembly_.feed_forward.reset();
  auto drives = std::make_unique<EmulatedCanDrives>(assembly_.machine, assembly_.machine.root.table("drives"),
                                                    truth_, truth_.root.table("drives"));
  field_ = drives.get();
  assembly_.drives = std::move(drives);
  if (assembly_.io) {
    auto held = std::make_unique<HeldIo>(std::move(assembly_.io));
    held_ = held.get();
    assembly_.io = std::move(held);
  }
  cycle_.reset(new Cycle(make_cycle(assembly_, queue_, ProgramStops::kPass)));
  cycle_->tick();
}

void EmulatedCommission::wait(double time_s) {
  const int periods = static_cast<int>(std::ceil(time_s / assembly_.machine.period_s));
  for (int i = 0; i < periods; ++i) {
    cycle_->tick();
    if (watcher_) watcher_(cycle_->last_report());
  }
}

// In real time, for once: how late is a period, and how long does it take?
double EmulatedCommission::latest_us(double time_s) {
  using Clock = std::chrono::steady_clock;
  const auto period = std::chrono::nanoseconds(std::llround(1e9 * assembly_.machine.period_s));
  const auto us = [](Clock::duration time) {
    return std::chrono::duration<double, std::micro>(time).count();
  };
  const int periods = static_cast<int>(std::ceil(time_s / assembly_.machine.period_s));
  double wake_us = 0, tick_us = 0;
  auto due = Clock::now() + period;
  for (int i = 0; i < periods; ++i, due += period) {
    std::this_thread::sleep_until(due);
    const auto begun = Clock::now();
    cycle_->tick();
    wake_us = std::max(wake_us, us(begun - due));
    tick_us = std::max(tick_us, us(Clock::now() - begun));
    if (begun - due > period) due = begun;
  }
  return wake_us + tick_us;
}

std::vector<ScannedBus> EmulatedCommission::scan() {
  constexpr std::int64_t kAnswer_ns = 5'000'000;
  std::vector<ScannedBus> out;
  for (std::size_t b = 0; b < field().config().buses.size(); ++b) {
    const auto endpoint = field().bus(b).open({{cob::kSdoAnswer, 0x780}});
    out.push_back({field().config().buses[b].interface, scan_nodes(*endpoint, kNodeIdMax, kAnswer_ns)});
  }
  return out;
}

void EmulatedCommission::press(HandStep step, int joint, bool on) {
  if (step == HandStep::kProbe && held_) held_->hold_probe(on);
  const CanDrivesConfig& config = field().config();
  for (std::size_t b = 0; b < config.buses.size(); ++b)
    for (std::size_t i = 0; i < config.buses[b].nodes.size(); ++i) {
      EmulatedDrive& drive = field().node(b, i).drive();
      if (step == HandStep::kProbe) {
        drive.touch(on, drive.joint().measured());
      } else if (config.buses[b].nodes[i].link.joint == joint) {
        const std::uint32_t bit = drive.switch_bit(step == HandStep::kPositiveSwitch);
        drive.set_inputs(on ? drive.inputs() | bit : drive.inputs() & ~bit);
      }
    }
}

JointVec EmulatedCommission::true_places() {
  JointVec q = JointVec::Zero(static_cast<Eigen::Index>(truth_.joints.size()));
  const CanDrivesConfig& config = field().config();
  for (std::size_t b = 0; b < config.buses.size(); ++b)
    for (std::size_t i = 0; i < config.buses[b].nodes.size(); ++i)
      q[config.buses[b].nodes[i].link.joint] = field().node(b, i).drive().joint().true_place();
  return q;
}

RehearsedOperator::RehearsedOperator(std::unique_ptr<CommissionMachine>& machine,
                                     std::function<void(const std::string&)> say)
    : machine_(machine), say_(std::move(say)) {}

bool RehearsedOperator::agrees(const std::string& text) {
  say_(text);
  if (machine_) {
    before_ = emulated().true_places();
    turns_before_ = machine_->report().spindle_turns;
  }
  return true;
}

double RehearsedOperator::measured(const std::string& text, int joint) {
  const bool rotary = emulated().truth().joints[static_cast<std::size_t>(joint)].kind == JointKind::kRotary;
  const double way = std::abs(emulated().true_places()[joint] - before_[joint]) * (rotary ? kDegPerRad : 1);
  // A good ruler shows a hundredth.
  const double seen = std::round(100 * way) / 100;
  say_(fmt::format("{}\n  > {:g}", text, seen));
  return seen;
}

// A spindle that is a joint is seen by its motor, another one by its encoder, which nobody has wired wrong
// here.
bool RehearsedOperator::turned_clockwise(const std::string& text) {
  const Machine& truth = emulated().truth();
  bool clockwise = machine_->report().spindle_turns > turns_before_;
  if (const auto axis = truth.root.table_if("spindle_axis")) {
    const auto kinematics = make_kinematics(truth);
    const int word = static_cast<int>(std::string_view(kWordLetters).find(axis->text("axis")[0]));
    Words from, to;
    kinematics->words_from_joints(before_, from);
    kinematics->words_from_joints(emulated().true_places(), to);
    clockwise = (to[word] < from[word]) == (axis->text("m3", "negative") == "negative");
  }
  say_(fmt::format("{}\n  > {}", text, clockwise ? "yes" : "no"));
  return clockwise;
}

bool RehearsedOperator::does(const std::string& text, HandStep step, int joint) {
  say_(text);
  emulated().press(holds_ = step, holds_joint_ = joint, true);
  return true;
}

void RehearsedOperator::lets_go(const std::string& text) {
  say_(text);
  emulated().press(holds_, holds_joint_, false);
}

bool RehearsedOperator::went_positive(const std::string& text, int word) {
  const std::optional<ToolWay> way = tool_way();
  bool positive = false;
  if (way && word <= kZ) {
    positive = way->tip[word] > 0;
  } else if (way) {
    positive = way->turn.dot(meant_turn(word)) > 0;
  } else {  // no pose is known there: by the words of the truth
    const auto kinematics = make_kinematics(emulated().truth());
    Words from, to;
    kinematics->words_from_joints(before_, from);
    kinematics->words_from_joints(emulated().true_places(), to);
    positive = to[word] > from[word];
  }
  say_(fmt::format("{}\n  > {}", text, positive ? "yes" : "no"));
  return positive;
}

// Tables that stand still count as turned to zero, since X is the machine's X on a turned table, too.
std::optional<RehearsedOperator::ToolWay> RehearsedOperator::tool_way() {
  constexpr double kTurned = 1e-4;  // rad
  const Machine& truth = emulated().truth();
  const auto kinematics = make_kinematics(truth);
  JointVec from = before_, to = emulated().true_places();
  for (std::size_t i = 0; i < truth.joints.size(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    if (truth.joints[i].kind == JointKind::kRotary && std::abs(to[k] - from[k]) < kTurned)
      from[k] = to[k] = 0;
  }
  Pose X_from, X_to;
  if (kinematics->forward(from, X_from) != KinStatus::kOk || kinematics->forward(to, X_to) != KinStatus::kOk)
    return std::nullopt;
  const Mat3 R_MB = kinematics->home_X_BM().R.transpose(), R = X_to.R * X_from.R.transpose();
  const Vec3 turn(R(2, 1) - R(1, 2), R(0, 2) - R(2, 0), R(1, 0) - R(0, 1));
  return ToolWay{R_MB * (X_to.p - X_from.p), R_MB * turn};
}

// A program's positive turn is what the config says it is: some tables turn by the word, others against it.
Vec3 RehearsedOperator::meant_turn(int word) const {
  const Kinematics& kinematics = *machine_->assembly().kinematics;
  Words from = Words::Zero();
  if (!kinematics.words_are_joints()) kinematics.words_from_joints(machine_->report().q_setpoint, from);
  for (const WordDirection& direction : word_directions(kinematics, from))
    if (direction.word == word && direction.known) return direction.turn;
  return Vec3::Unit(word - kA);
}

}  // namespace trn
