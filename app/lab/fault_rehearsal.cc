#include "app/lab/fault_rehearsal.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <stdexcept>
#include <utility>
#include <vector>

#include "app/lab/rehearsal_stage.h"
#include "app/session/make_cycle.h"
#include "core/axes.h"
#include "core/ports.h"
#include "core/signal_name.h"
#include "hal/can/bus.h"
#include "hal/can/can_config.h"
#include "hal/can/can_node_config.h"
#include "hal/can/frame.h"
#include "hal/can/gantry.h"
#include "hal/can/node_link.h"
#include "hal/can/node_setup.h"
#include "kernel/cycle.h"
#include "kernel/rt_messages.h"
#include "kernel/safety_inputs.h"
#include "sim/canopen/emulated_can.h"
#include "sim/canopen/emulated_drive.h"
#include "sim/canopen/emulated_node.h"
#include "sim/canopen/virtual_bus.h"

namespace trn {

namespace {

using T = EmulatedNode::Trouble;

constexpr double kStill = 1e-6;  // mm, rad: what a standing plant may do in a period
constexpr double kCount = 2e-4;  // and one that is switched on: two counts of 10,000 a mm
constexpr double kOffsetStands = 1e-9, kCorrections_s = 10;  // mm, rad a period; and how long at most
constexpr int kStandsPeriods = 20;
constexpr const char* kMotion = "G21 G91 G94\nG1 {}40 F1500\n";

/// Inputs beside the drives, as somebody else sets them.
class Cabinet final : public MachineIo {
 public:
  void exchange(const IoOutputs&, const IoPlace&, IoInputs& inputs) TRN_RT override { inputs = inputs_; }
  void set(int number, bool on) {
    const std::uint64_t bit = std::uint64_t{1} << number;
    inputs_.digital = on ? inputs_.digital | bit : inputs_.digital & ~bit;
  }

 private:
  IoInputs inputs_;
};

/// A machine on emulated CAN drives; at rest is what the plants say.
class Stage : public RehearsalStage {
 public:
  explicit Stage(const std::string& config)
      : RehearsalStage(assemble(config, Field::kEmulated)),
        field_(dynamic_cast<EmulatedCanDrives*>(assembly_.drives.get())) {
    if (!field_)
      throw std::runtime_error("the drives of this machine are on no CAN bus: nothing to rehearse");
    // The rehearsal begins with everything released, whatever the emulation of `run` has.
    for (const SafetyInputs::Input& input : assembly_.safety) set_input(input.from, input.safe_when_on);
    cycle_.reset(new Cycle(make_cycle(assembly_, queue_, ProgramStops::kPass, *assembly_.drives, &cabinet_,
                                      *assembly_.rate_plans)));
    victim = static_cast<int>(bus_config().nodes.size()) / 2;
  }

  EmulatedCanDrives& field() { return *field_; }
  VirtualBus& bus() { return field_->bus(0); }
  const CanBusConfig& bus_config() const { return field_->config().buses[0]; }
  double period_s() const { return assembly_.machine.period_s; }
  void trouble(T kind, std::int64_t value) {
    field_->node(0, static_cast<std::size_t>(victim)).trouble(kind, value, bus().now_ns());
  }
  void bring_up() { field_->bring_up(); }
  void start() {
    bring_up();
    require(until([&] { return enabled(); }, periods(10)) >= 0);
    home();
    tick(periods(0.5));
  }
  /// A move along the word, well on its way.
  void move(char word) {
    start_program(fmt::format(kMotion, word));
    tick(periods(0.4));
  }
  void reset() {
    field_->reset_faults();
    field_->bring_up();
    cycle_->post({RtCommand::Kind::kResetFault});
    tick();
  }
  JointVec places() const override {
    JointVec q = JointVec::Zero(static_cast<Eigen::Index>(assembly_.machine.joints.size()));
    for (std::size_t b = 0; b < field_->config().buses.size(); ++b)
      for (std::size_t i = 0; i < field_->config().buses[b].nodes.size(); ++i)
        add_place(field_->config().buses[b].nodes[i].link, field_->node(b, i).drive(), q);
    for (const Gantry::Config& gantry : field_->config().gantries) q[gantry.joint] /= gantry.motors;
    return q;
  }

  const std::vector<Gantry::Config>& gantries() const { return field_->config().gantries; }
  const std::vector<SafetyInputs::Input>& safety() const { return assembly_.safety; }
  void set_input(const SignalName& name, bool on) {
    if (!name.of_drive()) return cabinet_.set(name.number, on);
    for (std::size_t b = 0; b < field_->config().buses.size(); ++b)
      for (std::size_t i = 0; i < field_->config().buses[b].nodes.size(); ++i) {
        if (field_->config().buses[b].nodes[i].link.joint != name.joint) continue;
        EmulatedDrive& drive = field_->node(b, i).drive();
        const std::uint32_t bit = std::uint32_t{1} << name.number;
        drive.set_inputs(on ? drive.inputs() | bit : drive.inputs() & ~bit);
      }
  }

  /// A correction behind the plan goes on to what it wants after a stop on the path: until it stands.
  void let_corrections_end() {
    JointVec before = offsets();
    for (int i = 0, stands = 0; enabled() && i < periods(kCorrections_s) && stands < kStandsPeriods; ++i) {
      tick();
      const JointVec now = offsets();
      stands = (now - before).cwiseAbs().maxCoeff() < kOffsetStands ? stands + 1 : 0;
      before = now;
    }
  }

  int victim = 0;  ///< number of the node on the first bus to which things happen

 private:
  // The encoder of an absolute axis reads its own numbers, and the config has what lies between them and the
  // joint's.
  static void add_place(const NodeLink::Config& link, EmulatedDrive& drive, JointVec& q) {
    q[link.joint] += drive.joint().measured() + link.axis.offset;
  }
  JointVec offsets() const { return report().q_setpoint - report().q_plan; }
  void one_period() override { cycle_->tick(); }
  std::string explain() const override { return field_->explain_fault(-1); }

  EmulatedCanDrives* field_;
  Cabinet cabinet_;
};

struct Row {
  std::string cause;
  Fault fault;
  std::function<void(Stage&)> happen, mend;
  bool keeps_position = true;
  std::function<void(Stage&)> each_period = {};
  char word = 'X';  ///< of the motion
};

void nothing(Stage&) {}

std::function<void(Stage&)> trouble(T kind, std::int64_t value) {
  return [=](Stage& stage) { stage.trouble(kind, value); };
}

std::function<void(Stage&)> bus_state(BusState state) {
  return [=](Stage& stage) { stage.bus().set_state(state, true); };
}

// Up to 80 % of the bus in all, in frames of eight bytes at the lowest priority.
void foreign_traffic(Stage& stage) {
  const double free = 0.8 - stage.bus_config().budget.load();
  const double frames = free * stage.bus_config().bitrate * stage.period_s() / worst_frame_bits(8);
  for (int i = 0; i < std::max(1, static_cast<int>(frames)); ++i)
    stage.bus().inject(make_frame(0x6F0, {1, 2, 3, 4, 5, 6, 7, 8}));
}

// The drive obeys it, as any drive would; so it says nothing new.
void foreign_setpoint(Stage& stage) {
  const NodeLink& node = stage.field().master().master(0).nodes()[static_cast<std::size_t>(stage.victim)];
  CanFrame frame = make_frame(node.config().rpdos[0].id, {15, 0, 0, 0, 0, 0, 8});
  put_le(frame.data.data() + 2, 4, static_cast<std::uint32_t>(node.target_counts()));
  stage.bus().inject(frame);
}

std::vector<Row> rows() {
  const auto one_late = [](Stage& s) { s.trouble(T::kHeartbeatLate, std::llround(1e6 * s.period_s())); };
  return {
      {"node silent", Fault::kDriveLost, trouble(T::kSilent, 1), trouble(T::kSilent, 0)},
      {"node resets", Fault::kDriveRestarted, trouble(T::kReset, 0), nothing, false},
      {"EMCY, the drive goes on", Fault::kDriveWarning, trouble(T::kEmergency, 0x4210), nothing},
      {"drive faults", Fault::kDriveFault, trouble(T::kFault, 0x3210), nothing},
      {"drive faults without EMCY", Fault::kDriveFault, trouble(T::kQuietFault, 0x3210), nothing},
      {"drive ignores its setpoints", Fault::kDriveIgnores, trouble(T::kIgnore, 1), trouble(T::kIgnore, 0)},
      {"drive drops out", Fault::kDriveDropped, trouble(T::kDrop, 0), nothing},
      {"node leaves the operational state", Fault::kDriveDropped, trouble(T::kPreOperational, 0), nothing},
      {"no heartbeat, or no answer to guarding", Fault::kHeartbeatLost, trouble(T::kNoHeartbeat, 1),
       trouble(T::kNoHeartbeat, 0)},
      {"heartbeat late by one period", Fault::kOk, one_late, nothing},
      {"heartbeat late by 200 ms", Fault::kHeartbeatLost, trouble(T::kHeartbeatLate, 200'000), nothing},
      {"wrong mapping: feedback a byte short", Fault::kDriveLost, trouble(T::kShortPdo, 1),
       trouble(T::kShortPdo, 0)},
      {"feedback lies", Fault::kFollowingError, trouble(T::kLie, 2'000'000), trouble(T::kLie, 0)},
      {"duplicated frames", Fault::kOk, trouble(T::kDuplicate, 1), trouble(T::kDuplicate, 0)},
      {"reordered frames", Fault::kOk, trouble(T::kReorder, 1), trouble(T::kReorder, 0)},
      {"foreign traffic to 80 % load", Fault::kOk, nothing, nothing, true, foreign_traffic},
      {"second master: SYNC", Fault::kForeignMaster, [](Stage& s) { s.bus().inject(sync_frame(0)); },
       nothing},
      {"second master: a setpoint", Fault::kForeignMaster, foreign_setpoint, nothing},
      {"bus-off", Fault::kBusOff, bus_state(BusState::kBusOff), nothing},
      {"the interface's queue is full", Fault::kBusOverload, [](Stage& s) { s.bus().jam(true); },
       [](Stage& s) { s.bus().jam(false); }},
      {"interface down and up", Fault::kBusDown, bus_state(BusState::kDown), bus_state(BusState::kOnline)},
  };
}

Row row_of(std::string cause, Fault fault, std::function<void(Stage&)> happen,
           std::function<void(Stage&)> mend) {
  return {std::move(cause), fault, std::move(happen), std::move(mend)};
}

// As `trouble`, with the last node on the first bus for which `is` holds.
template <typename Is>
std::function<void(Stage&)> trouble_of(Is is, T kind, std::int64_t value) {
  return [=](Stage& stage) {
    const std::vector<CanNodeConfig>& nodes = stage.bus_config().nodes;
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (is(nodes[i].link)) stage.victim = static_cast<int>(i);
    stage.trouble(kind, value);
  };
}

// Of a machine that has a gantry; its joint is named as its word is.
void add_gantry_rows(const Stage& stage, std::vector<Row>& rows) {
  if (stage.gantries().empty()) return;
  const int joint = stage.gantries()[0].joint;
  const auto motor = [joint](const NodeLink::Config& link) { return link.joint == joint; };
  const std::size_t first = rows.size();
  rows.push_back(row_of("one side of the gantry is held", Fault::kGantryParted,
                        trouble_of(motor, T::kHeld, 1), trouble_of(motor, T::kHeld, 0)));
  rows.push_back(row_of("one motor of the gantry faults", Fault::kDriveFault,
                        trouble_of(motor, T::kFault, 0x3210), nothing));
  for (std::size_t i = first; i < rows.size(); ++i) rows[i].word = stage.gantries()[0].name[0];
}

void add_drive_rows(const Stage& stage, std::vector<Row>& rows) {
  const auto brake = [](const NodeLink::Config& link) { return link.brake.fitted; };
  const auto sto = [](const NodeLink::Config& link) { return link.sto.known; };
  const auto has = [&](auto is) {
    const auto& nodes = stage.bus_config().nodes;
    return std::any_of(nodes.begin(), nodes.end(), [&](const CanNodeConfig& node) { return is(node.link); });
  };
  if (has(sto))
    rows.push_back(row_of("Safe Torque Off of a drive", Fault::kSafeTorqueOff, trouble_of(sto, T::kSto, 1),
                          trouble_of(sto, T::kSto, 0)));
  if (!has(brake)) return;
  rows.push_back(row_of("the drive of an axis with a brake faults", Fault::kDriveFault,
                        trouble_of(brake, T::kFault, 0x3210), nothing));
  rows.push_back(row_of("the drive of an axis with a brake is silent", Fault::kDriveLost,
                        trouble_of(brake, T::kSilent, 1), trouble_of(brake, T::kSilent, 0)));
}

const char* cause_of(SafetyKind kind) {
  switch (kind) {
    case SafetyKind::kEmergencyStop:
      return "input: emergency stop";
    case SafetyKind::kEnable:
      return "input: enable goes off";
    case SafetyKind::kDoor:
      return "input: a door is opened";
    case SafetyKind::kAir:
    case SafetyKind::kCount:
      break;
  }
  return "input: air pressure away";
}

void add_input_rows(const Stage& stage, std::vector<Row>& rows) {
  for (const SafetyInputs::Input& input : stage.safety())
    rows.push_back(row_of(
        cause_of(input.kind), SafetyInputs::fault_of(input.kind),
        [input](Stage& s) { s.set_input(input.from, !input.safe_when_on); },
        [input](Stage& s) { s.set_input(input.from, input.safe_when_on); }));
}

std::vector<Row> rows_of(const std::string& config) {
  const Stage stage(config);
  std::vector<Row> all = rows();
  add_gantry_rows(stage, all);
  add_drive_rows(stage, all);
  add_input_rows(stage, all);
  return all;
}

RehearsedFault rehearse(const std::string& config, const Row& row) {
  Stage stage(config);
  stage.start();
  stage.move(row.word);
  RehearsedFault out;
  out.cause = row.cause;
  out.wanted = row.fault;
  row.happen(stage);
  const auto victim = static_cast<std::size_t>(stage.victim);
  out.keeps_position = row.keeps_position || stage.bus_config().nodes[victim].link.axis.absolute;
  const int limit = row.fault == Fault::kOk ? 0 : stage.periods(2);
  out.to_fault = stage.until([&] { return stage.report().fault != Fault::kOk; }, limit);
  const int rest = stage.wait_for_rest(kStill, [&] {
    if (row.each_period) row.each_period(stage);
  });
  out.to_rest = rest < 0 ? -1 : rest + std::max(out.to_fault, 0);
  out.fault = stage.report().fault;
  out.message = stage.field().explain_fault(stage.report().fault_joint);
  stage.let_corrections_end();
  out.crept = stage.moves_in(stage.periods(1));
  row.mend(stage);
  stage.tick(stage.periods(0.2));
  stage.reset();
  const int wait = stage.until([&] { return stage.ready(); }, stage.periods(10));
  out.to_recover = wait < 0 ? -1 : wait + 1;
  stage.tick(stage.periods(0.1));
  const double apart = (stage.report().q_measured - stage.places()).cwiseAbs().maxCoeff();
  out.kept_position = stage.homed() && apart < 1e-3;
  return out;
}

// Every object that a bring-up reads or writes.
std::set<int> objects_of(const std::string& config) {
  const Stage stage(config);
  std::set<int> out;
  for (const SetupStep& step : stage.bus_config().nodes[static_cast<std::size_t>(stage.victim)].setup.steps)
    out.insert(step.key.index);
  return out;
}

}  // namespace

bool RehearsedFault::good() const {
  return fault == wanted && to_rest >= 0 && crept < 1e-4 && to_recover >= 0 &&
         kept_position == keeps_position;
}

std::vector<RehearsedFault> rehearse_faults(const std::string& config,
                                            const std::function<void(const RehearsedFault&)>& on_row) {
  std::vector<RehearsedFault> out;
  for (const Row& row : rows_of(config)) {
    out.push_back(rehearse(config, row));
    if (on_row) on_row(out.back());
  }
  return out;
}

std::vector<RefusedStep> rehearse_refusals(const std::string& config) {
  std::vector<RefusedStep> out;
  for (const int index : objects_of(config)) {
    Stage stage(config);
    stage.tick();
    stage.trouble(T::kRefuse, index);
    RefusedStep step{fmt::format("0x{:04X}", index), "", "", false, false};
    try {
      stage.bring_up();
    } catch (const std::runtime_error& error) {
      step.message = error.what();
    }
    const std::vector<std::string> warnings = stage.field().warnings();
    if (step.message.empty() && !warnings.empty()) step.warning = warnings[0];
    const bool enabled = stage.until([&] { return stage.enabled(); }, stage.periods(0.5)) >= 0;
    // A drive that comes up all the same is enabled, and settles on the count that is nearest.
    const double most = step.message.empty() ? kCount : kStill;
    step.moved = stage.moves_in(stage.periods(0.5)) > most || (enabled && !step.message.empty());
    stage.trouble(T::kRefuse, 0);
    stage.reset();
    step.recovered = stage.until([&] { return stage.enabled(); }, stage.periods(10)) >= 0;
    out.push_back(step);
  }
  return out;
}

}  // namespace trn
