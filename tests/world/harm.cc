#include "tests/world/harm.h"

#include <fmt/format.h>

#include <utility>
#include <vector>

#include "core/fault.h"
#include "hal/can/bus.h"
#include "hal/can/frame.h"
#include "hal/can/nmt.h"
#include "sim/canopen/emulated_can.h"
#include "sim/canopen/emulated_drive.h"
#include "sim/canopen/emulated_node.h"
#include "sim/canopen/virtual_bus.h"
#include "sim/simulated_drives.h"
#include "sim/simulated_joint.h"
#include "tests/world/promises.h"

namespace trn::world {

namespace {

class SimulatedHarm final : public Harm {
 public:
  SimulatedHarm(SimulatedDrives& drives, Eigen::Index joints, double share, std::uint64_t seed)
      : Harm(share, seed), drives_(drives), joints_(static_cast<int>(joints)) {}

  JointVec places() override {
    JointVec q = JointVec::Zero(joints_);
    for (int i = 0; i < joints_; ++i) q[i] = drives_.joint(i).measured();
    return q;
  }

 private:
  void strike() override {
    SimulatedJoint& joint = drives_.joint(below(joints_));
    switch (below(4)) {
      case 0:
        Chronicle::note("harm: a drive faults");
        return joint.fail(Fault::kDriveFault);
      case 1:
        joint.set_lost(true);
        return for_a_while("a drive does not answer", [&joint] { joint.set_lost(false); });
      case 2:
        joint.set_stuck(true);
        return for_a_while("an axis is stuck", [&joint] { joint.set_stuck(false); });
      default:
        Chronicle::note("harm: brown-out, all drives restart");
        for (int i = 0; i < joints_; ++i) drives_.joint(i).power_cycle();
    }
  }

  SimulatedDrives& drives_;
  int joints_;
};

class CanHarm final : public Harm {
 public:
  CanHarm(EmulatedCanDrives& field, double share, std::uint64_t seed) : Harm(share, seed), field_(field) {
    for (std::size_t i = 0; i < field_.config().buses[0].nodes.size(); ++i)
      for (unsigned bit = 0; bit < 32; ++bit)
        if (drive(i).inputs() >> bit & 1u) watches_.emplace_back(i, bit);
  }

  bool one_thread() const override { return true; }
  bool may_bring_up() const override { return field_.master().brakes_hold(); }
  JointVec places() override {
    const auto& nodes = field_.config().buses[0].nodes;
    JointVec q = JointVec::Zero(static_cast<Eigen::Index>(nodes.size()));
    for (std::size_t i = 0; i < nodes.size(); ++i)
      q[nodes[i].link.joint] = field_.node(0, i).drive().joint().measured();
    return q;
  }

 private:
  using T = EmulatedNode::Trouble;

  void strike() override {
    if (!watches_.empty() && below(3) == 0) return strike_safety();
    const int kind = below(19);
    if (kind < 13) return strike_node(kind);
    VirtualBus& bus = field_.bus(0);
    switch (kind) {
      case 13:
        Chronicle::note("harm: bus-off");
        return bus.set_state(BusState::kBusOff, true);
      case 14:
        bus.set_state(BusState::kDown, true);
        return for_a_while("the interface is down", [&bus] { bus.set_state(BusState::kOnline); });
      case 15:
        bus.jam(true);
        return for_a_while("the interface's queue is full", [&bus] { bus.jam(false); });
      case 16:
        Chronicle::note("harm: a second master's SYNC");
        return bus.inject(sync_frame(0));
      default:
        return noise(bus);
    }
  }

  EmulatedDrive& drive(std::size_t node) { return field_.node(0, node).drive(); }

  // A door, a button or an air hose opens its input; or a drive's own safety input takes its torque.
  void strike_safety() {
    const auto& [node, bit] = watches_[static_cast<std::size_t>(below(static_cast<int>(watches_.size())))];
    EmulatedDrive& victim = drive(node);
    if (below(4) == 0) {
      victim.set_sto(true);
      return for_a_while("a drive's torque is off", [&victim] { victim.set_sto(false); });
    }
    victim.set_inputs(victim.inputs() & ~(1u << bit));
    for_a_while("a safety input is open",
                [&victim, on = 1u << bit] { victim.set_inputs(victim.inputs() | on); });
  }

  // Frames of any identifier and content.
  void noise(VirtualBus& bus) {
    Chronicle::note("harm: noise on the bus");
    for (int frames = 1 + below(6); frames > 0; --frames) {
      CanFrame frame = make_frame(static_cast<std::uint32_t>(below(0x800)), {0, 0, 0, 0, 0, 0, 0, 0});
      for (int i = 0; i < 8; ++i)
        frame.data[static_cast<std::size_t>(i)] = static_cast<std::uint8_t>(below(256));
      bus.inject(frame);
    }
  }

  void strike_node(int kind) {
    struct Row {
      T trouble;
      std::int64_t value;
      bool lasts;
      const char* text;
    };
    static constexpr Row kRows[] = {
        {T::kSilent, 1, true, "a node is silent"},
        {T::kReset, 0, false, "a node restarts"},
        {T::kEmergency, 0x4210, false, "a node sends an emergency message"},
        {T::kFault, 0x3210, false, "a drive faults"},
        {T::kNoHeartbeat, 1, true, "a node sends no heartbeat"},
        {T::kHeartbeatLate, 200'000, false, "a heartbeat is late"},
        {T::kDrop, 0, false, "a drive drops out"},
        {T::kDuplicate, 1, true, "frames come twice"},
        {T::kReorder, 1, true, "frames come in another order"},
        {T::kShortPdo, 1, true, "feedback is a byte short"},
        {T::kLie, 2'000'000, true, "feedback lies"},
        {T::kPreOperational, 0, false, "a node leaves the operational state"},
        {T::kSlow, 3000, true, "a node answers late"},
    };
    const Row& row = kRows[kind];
    const auto victim =
        static_cast<std::size_t>(below(static_cast<int>(field_.config().buses[0].nodes.size())));
    field_.node(0, victim).trouble(row.trouble, row.value, field_.bus(0).now_ns());
    if (!row.lasts) return Chronicle::note(fmt::format("harm: {}", row.text));
    for_a_while(row.text, [this, victim, trouble = row.trouble] {
      field_.node(0, victim).trouble(trouble, 0, field_.bus(0).now_ns());
    });
  }

  EmulatedCanDrives& field_;
  std::vector<std::pair<std::size_t, unsigned>> watches_;  ///< nodes and bits of inputs that are on
};

}  // namespace

void Harm::step() {
  ++period_;
  acted_ = false;
  for (auto due = mends_.begin(); due != mends_.end() && due->first <= period_; due = mends_.erase(due)) {
    due->second();
    acted_ = true;
  }
  if (static_cast<double>(random_() >> 11) * 0x1p-53 >= share_) return;
  acted_ = true;
  strike();
}

void Harm::for_a_while(const char* what, std::function<void()> mend) {
  const std::uint64_t periods = 1 + random_() % 400;
  Chronicle::note(fmt::format("harm: {} for {} periods", what, periods));
  mends_.emplace(period_ + periods, std::move(mend));
}

std::unique_ptr<Harm> make_harm(Drives& drives, Eigen::Index joints, double share, std::uint64_t seed) {
  if (auto* const simulated = dynamic_cast<SimulatedDrives*>(&drives))
    return std::make_unique<SimulatedHarm>(*simulated, joints, share, seed);
  if (auto* const field = dynamic_cast<EmulatedCanDrives*>(&drives))
    return std::make_unique<CanHarm>(*field, share, seed);
  return nullptr;
}

}  // namespace trn::world
