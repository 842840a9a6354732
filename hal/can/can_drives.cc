#include "hal/can/can_drives.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <limits>
#include <stdexcept>
#include <thread>

#include "core/axes.h"
#include "core/check.h"
#include "hal/can/can_node_config.h"
#include "hal/can/cia402_axis.h"
#include "hal/can/frame.h"
#include "hal/can/gantry.h"
#include "hal/drive_requests.h"
#include "hal/drive_severity.h"

namespace trn {

namespace {

constexpr std::int64_t kSlice = 1'000'000;      // ns between looks at the bus during bring-up
constexpr double kTickAnswers_s = 2;            // a tick that takes longer for a period is gone
constexpr std::int64_t kUntaken = 500'000'000;  // ns: by then the slowest bus has carried a full queue

CanMaster::Config master_config(const CanDrivesConfig& config, const CanBusConfig& bus) {
  return {config.period_s,          config.master_id,    config.sync_counter,
          config.heartbeat_periods, config.overload_max, bus};
}

double value_of(const JointVec& values, Eigen::Index joint) TRN_RT {
  return joint < values.size() ? values[joint] : 0;
}

std::string no_fd_text(const std::string& interface, const CanBusConfig& bus) {
  return fmt::format(
      "{0}: the config wants CAN FD, the interface carries classic frames; ip link set {0} down; ip link set "
      "{0} up "
      "type can bitrate {1} dbitrate {2} fd on (a virtual one: ip link set {0} mtu 72)",
      interface, bus.bitrate, bus.data_bitrate);
}

}  // namespace

CanDrives::CanDrives(const CanDrivesConfig& config, std::unique_ptr<CanOpener> opener)
    : config_(config), opener_(std::move(opener)) {
  for (const CanBusConfig& bus : config.buses) {
    buses_.push_back(std::make_unique<Bus>());
    buses_.back()->master = std::make_unique<CanMaster>(master_config(config, bus));
  }
  make_gantries();
}

void CanDrives::make_gantries() {
  for (const Gantry::Config& gantry : config_.gantries) {
    std::vector<NodeLink*> motors;
    for (auto& bus : buses_)
      for (NodeLink& node : bus->master->nodes())
        if (node.config().joint == gantry.joint) motors.push_back(&node);
    gantries_.push_back(std::make_unique<GantryLink>(gantry, std::move(motors)));
  }
}

// True if the endpoints are as good as new ones. What the controller said of itself meanwhile, also that it
// was restarted, waits in the service's endpoint.
bool CanDrives::restore(Bus& bus) {
  if (!bus.service) return false;
  const bool lost = bus.lost.exchange(false);
  std::array<CanFrame, 64> in;
  // All that was heard since: the endpoint's state is brought up to date by hearing it.
  for (int batch = 0; batch < 1000 && bus.service->receive(in) > 0;) ++batch;
  if (bus.service->state() == BusState::kOnline) return !lost;
  bus.service->recover();
  return false;
}

void CanDrives::open(Bus& bus) {
  CanMaster& master = *bus.master;
  const std::string& interface = master.config().bus.interface;
  if (restore(bus)) return;
  bus.service = opener_->open(interface, master.service_filters());
  if (master.config().bus.fd && !bus.service->carries_fd())
    throw std::runtime_error(no_fd_text(interface, master.config().bus));
  bus.opened.push_back(opener_->open(interface, master.tick_filters()));
  bus.opened.back()->confirm_sends();
  // The tick takes the new endpoint at its next exchange, never in the middle of one. Until it has, the old
  // one must not be closed under it, so that is left to a later call.
  bus.offered.store(bus.opened.back().get(), std::memory_order_release);
  std::erase_if(bus.opened, [&](const auto& old) {
    return old.get() != bus.opened.back().get() && old.get() != bus.in_use.load(std::memory_order_acquire);
  });
}

// Which nodes these are is kept: the tick may lose another one meanwhile, which is a matter of the next
// reset.
std::vector<NodeLink*> CanDrives::nodes_to_set_up(Bus& bus) {
  std::vector<NodeLink*> nodes;
  for (NodeLink& node : bus.master->nodes())
    if (node.shared().needs_setup.load()) nodes.push_back(&node);
  return nodes;
}

std::vector<NodeSetup> CanDrives::make_setups(Bus& bus, const std::vector<NodeLink*>& nodes) {
  std::vector<NodeSetup> setups;
  for (const NodeLink* node : nodes) {
    const auto i = static_cast<std::size_t>(node - bus.master->nodes().data());
    setups.emplace_back(bus.master->config().bus.nodes[i].setup, bus.service->now_ns());
  }
  return setups;
}

// All nodes of a bus at once, each with an SDO channel of its own.
void CanDrives::run(std::vector<NodeSetup>& setups, CanEndpoint& endpoint) {
  const auto busy = [&] {
    return std::any_of(setups.begin(), setups.end(),
                       [](const NodeSetup& setup) { return !setup.finished(); });
  };
  std::array<CanFrame, 32> in;
  std::vector<CanFrame> unsent;
  std::int64_t taken_ns = endpoint.now_ns();  // when the controller last had room
  while (true) {
    CanFrame frame;
    for (NodeSetup& setup : setups)
      while (setup.next_frame(frame)) unsent.push_back(frame);
    if (!busy() && unsent.empty()) return;
    // A controller's queue is short, ten frames by default. What does not fit is offered again a millisecond
    // later, in the same order.
    const int taken = endpoint.send(unsent);
    if (taken > 0 || unsent.empty()) taken_ns = endpoint.now_ns();
    unsent.erase(unsent.begin(), unsent.begin() + std::max(taken, 0));
    if (endpoint.now_ns() - taken_ns > kUntaken)
      throw std::runtime_error(
          "the CAN interface has taken no frame for half a second: nobody on the bus acknowledges them; "
          "check "
          "cable, termination, bit rate and the drives' supply, then reset");
    if (endpoint.state() != BusState::kOnline) {
      const std::string trouble = endpoint.recover();
      throw std::runtime_error(trouble.empty()
                                   ? "the CAN interface went off while the drives were set up; check "
                                     "cable, termination and bit rate, then reset"
                                   : trouble);
    }
    endpoint.wait(kSlice);
    const int count = endpoint.receive(in);
    for (NodeSetup& setup : setups) {
      for (int i = 0; i < count; ++i) setup.receive(in[static_cast<std::size_t>(i)], endpoint.now_ns());
      setup.poll(endpoint.now_ns());
    }
  }
}

const NodeLink* CanDrives::held_by_drive() const {
  for (const auto& bus : buses_)
    for (const NodeLink& node : bus->master->nodes())
      if (node.shared().needs_setup.load() && !node.shared().braked.load()) return &node;
  return nullptr;
}

// A drive loses its torque when it is set up. That of an axis that hangs still holds it for a moment behind
// the fault, until the brake does. The tick closes the brake meanwhile.
void CanDrives::wait_for_brakes() const {
  const auto begin = std::chrono::steady_clock::now();
  while (const NodeLink* node = held_by_drive()) {
    const Brake::Config& brake = node->config().brake;
    const std::chrono::duration<double> limit(
        kTickAnswers_s + config_.period_s * (brake.stop_periods_max + brake.close_periods));
    if (std::chrono::steady_clock::now() - begin > limit)
      throw std::runtime_error(
          fmt::format("{}: its brake has not been closed for {:.1f} s, and without it the axis would fall "
                      "while the drive is set up; reset again",
                      node->config().name, limit.count()));
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

void CanDrives::set_up(Bus& bus) {
  const std::vector<NodeLink*> nodes = nodes_to_set_up(bus);
  std::vector<NodeSetup> setups = make_setups(bus, nodes);
  run(setups, *bus.service);
  finish(nodes, setups);
}

void CanDrives::finish(const std::vector<NodeLink*>& nodes, const std::vector<NodeSetup>& setups) {
  std::vector<std::string> errors;
  TRN_CHECK(nodes.size() == setups.size());
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    NodeLink& node = *nodes[i];
    const NodeSetup& setup = setups[i];
    {
      const std::scoped_lock lock(warnings_mutex_);
      warnings_[node.config().name] = setup.warnings();
    }
    if (!setup.error().empty()) {
      errors.push_back(setup.error());
      continue;
    }
    // A drive that lost power has lost its zero as well, unless its encoder is absolute.
    if (setup.was_restarted()) node.shared().position_lost.store(true);
    // In this order: the tick sees `watched` last, and by then the new count of set-ups tells it to forget
    // what it heard before.
    node.shared().needs_setup.store(false);
    node.shared().setups.fetch_add(1, std::memory_order_release);
    node.shared().watched.store(true, std::memory_order_release);
  }
  if (!errors.empty()) throw std::runtime_error(fmt::format("{}", fmt::join(errors, "\n")));
}

void CanDrives::bring_up() {
  requests_.fetch_or(kComingUp);
  wait_for_brakes();
  // All interfaces first: a second one that is missing must be told before drives of the first are under way.
  for (auto& bus : buses_) open(*bus);
  for (auto& bus : buses_) set_up(*bus);
  ask_unless_stopped(requests_, kEnable);
}

void CanDrives::reset_faults() {
  for (auto& bus : buses_)
    for (NodeLink& node : bus->master->nodes())
      if (node.shared().needs_setup.load()) node.shared().watched.store(false);
  requests_.fetch_or(kReset);
}

void CanDrives::shut_down() noexcept { requests_.fetch_or(kDisable); }

unsigned CanDrives::closed_ends(int joint) const {
  return closed_ends_[static_cast<std::size_t>(joint)].load(std::memory_order_relaxed);
}

std::string CanDrives::explain_fault(int joint) const {
  for (const auto& gantry : gantries_)
    if (joint < 0 || gantry->joint() == joint)
      if (std::string text = gantry->explain(); !text.empty()) return text;
  for (const auto& bus : buses_) {
    for (const NodeLink& node : bus->master->nodes())
      if (joint < 0 || node.config().joint == joint)
        if (std::string text = node.explain(); !text.empty()) return text;
    const Fault fault = bus->fault.load();
    if (joint < 0 && fault != Fault::kOk)
      return fmt::format("{}: {}", bus->master->config().bus.interface, fault_info(fault).meaning);
  }
  return "";
}

std::string CanDrives::health() const {
  std::vector<std::string> lines;
  for (const auto& bus : buses_) lines.push_back(bus->master->health());
  return fmt::format("{}", fmt::join(lines, "; "));
}

std::vector<std::string> CanDrives::warnings() const {
  const std::scoped_lock lock(warnings_mutex_);
  std::vector<std::string> out;
  for (const CanBusConfig& bus : config_.buses)
    for (const CanNodeConfig& node : bus.nodes)
      out.insert(out.end(), node.warnings.begin(), node.warnings.end());
  for (const auto& [name, lines] : warnings_) out.insert(out.end(), lines.begin(), lines.end());
  return out;
}

void CanDrives::exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT {
  TRN_CHECK(setpoints.q.size() == setpoints.qd.size());
  for (auto& bus : buses_) {
    CanEndpoint* offered = bus->offered.exchange(nullptr, std::memory_order_acq_rel);
    if (offered) {
      const bool again = bus->master->endpoint() != nullptr;
      bus->master->attach(offered);
      if (again) bus->master->reset();  // what was wrong was the one before
      bus->in_use.store(offered, std::memory_order_release);
    }
    bus->master->receive();
  }
  // What was heard, then what was asked for, then the drives' steps, then sending: a drive that has just
  // reported a fault gets no setpoint in this period.
  take_requests();
  home_next();
  step_nodes(setpoints);
  for (auto& bus : buses_) bus->master->send();
  report(feedback);
  // All or none: a path with one joint missing is another path. While one drive is not enabled the others
  // hold their place.
  follow_ = feedback.state == DriveState::kEnabled;
}

void CanDrives::step_nodes(const Setpoints& setpoints) TRN_RT {
  for (auto& bus : buses_)
    for (NodeLink& node : bus->master->nodes()) {
      node.set_outputs(setpoints.outputs[static_cast<std::size_t>(node.config().joint)]);
      const auto joint = static_cast<Eigen::Index>(node.config().joint);
      if (node.config().gantry) continue;
      node.set_offsets(value_of(setpoints.velocity_offset, joint), value_of(setpoints.force_offset, joint));
      node.step(setpoints.q[joint], setpoints.qd[joint], follow_);
    }
  for (auto& gantry : gantries_) gantry->step(setpoints, follow_);
}

void CanDrives::take_requests() TRN_RT {
  const unsigned requests = take_asked(requests_);
  if (requests == 0) return;
  for (auto& bus : buses_) {
    if (requests & (kReset | kDisable)) waiting_homes_ = 0;
    if (requests & kReset) bus->master->reset();
    for (NodeLink& node : bus->master->nodes()) {
      if (requests & kDisable)
        node.disable();
      else if (requests & kEnable)  // of a bring-up that has just ended: off means off
        node.enable();
    }
  }
  if (requests & kReset)
    for (auto& gantry : gantries_) gantry->reset();
}

void CanDrives::request_home(unsigned joint_mask) TRN_RT { waiting_homes_ |= joint_mask; }

// Group by group: the next one begins when none of this one is under way any more. A joint that fails is a
// fault, whose reaction stops the others and forgets those that wait.
void CanDrives::home_next() TRN_RT {
  if (waiting_homes_ == 0) return;
  for (const auto& gantry : gantries_)
    if (gantry->homing()) return;
  int group = std::numeric_limits<int>::max();
  for (const auto& bus : buses_)
    for (const NodeLink& node : bus->master->nodes()) {
      if (node.axis().homing()) return;
      if (waiting_homes_ >> node.config().joint & 1u) group = std::min(group, node.config().home_group);
    }
  unsigned begun = 0;
  for (auto& bus : buses_)
    for (NodeLink& node : bus->master->nodes()) {
      const unsigned bit = 1u << node.config().joint;
      if (!(waiting_homes_ & bit) || node.config().home_group != group) continue;
      begun |= bit;  // all motors of a gantry
      node.axis().home();
    }
  waiting_homes_ &= ~begun;
}

void CanDrives::quick_stop() TRN_RT {
  take_back(requests_, kEnable);
  waiting_homes_ = 0;
  for (auto& bus : buses_)
    for (NodeLink& node : bus->master->nodes()) node.axis().quick_stop();
}

int CanDrives::touch_periods() const TRN_RT { return config_.touch_periods; }

void CanDrives::arm_touch(bool contact) TRN_RT {
  for (auto& bus : buses_)
    for (NodeLink& node : bus->master->nodes()) node.touch().arm(contact);
}

void CanDrives::disarm_touch() TRN_RT {
  for (auto& bus : buses_)
    for (NodeLink& node : bus->master->nodes()) node.touch().disarm();
}

void CanDrives::report(Feedback& feedback) TRN_RT {
  feedback.state = DriveState::kEnabled;
  feedback.fault = Fault::kOk;
  feedback.fault_joint = -1;
  // Joints that wait for their turn are on their way home, though they stand.
  if (waiting_homes_ != 0) feedback.state = DriveState::kHoming;
  feedback.homed_mask = feedback.limit_switch_mask = 0;
  feedback.inputs = {};
  feedback.inputs_heard_mask = 0;
  feedback.held = {};
  // One contact is enough, but all drives must be armed: each latches its own position at the same moment.
  touch_ = {false, true, 0, feedback.q};
  ends_ = {};
  for (auto& bus : buses_) {
    for (const NodeLink& node : bus->master->nodes()) report_node(node, feedback);
    const Fault fault = bus->master->fault();
    bus->fault.store(fault, std::memory_order_relaxed);
    if (fault == Fault::kBusOff || fault == Fault::kBusDown) bus->lost.store(true);
    feedback.fault = worse(feedback.fault, fault);
  }
  for (std::size_t i = 0; i < ends_.size(); ++i) closed_ends_[i].store(ends_[i], std::memory_order_relaxed);
  for (const auto& gantry : gantries_) {
    gantry->report(feedback);
    if (config_.touch_periods > 0) gantry->report_touch(touch_);
  }
}

void CanDrives::report_touch(const NodeLink& node) TRN_RT {
  const int joint = node.config().joint;
  touch_.contact |= node.touch_contact();
  touch_.armed &= node.touch().armed();
  if (!node.touch().latched()) return;
  touch_.latched_mask |= 1u << joint;
  TRN_CHECK(joint < touch_.q.size());
  touch_.q[joint] = node.axis().position_of(node.touch().counts());
}

void CanDrives::report_brake(const Brake& brake, HeldOutputs& held) TRN_RT {
  if (!brake.config().fitted || brake.config().of_drive) return;
  const std::uint64_t bit = std::uint64_t{1} << brake.config().output;
  held.mask |= bit;
  if (brake.output()) held.on |= bit;
}

namespace {
// A drive names its switches by its own direction, which is the other way round on a reversed joint.
unsigned ends_of(const NodeLink& node) TRN_RT {
  const unsigned ends = node.limit_switches();
  return node.config().axis.counts_per_unit > 0 ? ends : (ends >> 1 & 1u) | (ends & 1u) << 1;
}
}  // namespace

void CanDrives::report_node(const NodeLink& node, Feedback& feedback) TRN_RT {
  const int joint = node.config().joint;
  TRN_CHECK(joint >= 0 && joint < feedback.q.size());
  const Cia402Axis& axis = node.axis();
  feedback.q[joint] = axis.measured();
  if (axis.homed()) feedback.homed_mask |= 1u << joint;
  if (node.limit_switches()) feedback.limit_switch_mask |= 1u << joint;
  ends_[static_cast<std::size_t>(joint)] |= ends_of(node);
  feedback.inputs[static_cast<std::size_t>(joint)] |= node.inputs();
  if (node.inputs_heard()) feedback.inputs_heard_mask |= 1u << joint;
  report_brake(node.brake(), feedback.held);
  if (config_.touch_periods > 0) report_touch(node);
  feedback.words[static_cast<std::size_t>(joint)] = node.words();
  if (double force = 0; node.force(force)) {
    // Joints whose drives do not tell have a force that is no number.
    if (feedback.force.size() == 0)
      feedback.force.setConstant(feedback.q.size(), std::numeric_limits<double>::quiet_NaN());
    feedback.force[joint] = force;
  }
  feedback.state = worst(feedback.state, node.state());
  const Fault worst_fault = worse(feedback.fault, node.fault());
  if (worst_fault == feedback.fault) return;
  feedback.fault = worst_fault;
  feedback.fault_joint = joint;
}

}  // namespace trn
