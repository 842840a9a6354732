#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <utility>
#include <vector>

#include "core/axes.h"
#include "core/config.h"
#include "core/machine.h"
#include "core/ports.h"
#include "sim/canopen/emulated_can.h"
#include "sim/canopen/emulated_node.h"
#include "sim/canopen/virtual_bus.h"
#include "tests/support/paths.h"

namespace trn {

using Edits = std::vector<std::pair<std::string, std::string>>;

inline constexpr int kReady = 200;  ///< periods until everything must be enabled

/// Greatest mean speed over so many periods, long enough that the overshoot of a servo does not count.
class Speedometer {
 public:
  explicit Speedometer(std::size_t periods) : periods_(periods) {}
  void take(double place, double period_s) {
    places_.push_back(place);
    if (places_.size() <= periods_) return;
    const double way = place - places_[places_.size() - 1 - periods_];
    fastest_ = std::max(fastest_, std::abs(way) / (static_cast<double>(periods_) * period_s));
  }
  double fastest() const { return fastest_; }

 private:
  std::size_t periods_;
  std::vector<double> places_;
  double fastest_ = 0;
};

/// A machine on buses in memory, driven tick by tick.
class Field {
 public:
  /// `edits`: texts of the config and what stands in their place.
  explicit Field(const std::string& config, const Edits& edits = {})
      : machine_(read_machine(edited(source_dir() + "/configs/" + config, edits))),
        drives(machine_, machine_.root.table("drives")) {
    const auto n = static_cast<Eigen::Index>(machine_.joints.size());
    setpoints.q = setpoints.qd = feedback.q = JointVec::Zero(n);
  }

  void tick() {
    ++period;
    if (feedback.state != DriveState::kEnabled) setpoints.q = feedback.q;
    setpoints.q += setpoints.qd * machine_.period_s;
    if (feedback.state != DriveState::kEnabled) setpoints.qd.setZero();
    drives.exchange(setpoints, feedback);
  }
  /// Periods until `done`, at most `limit`; -1 if it does not come.
  int until(const std::function<bool()>& done, int limit) {
    for (int i = 0; i <= limit; ++i) {
      if (done()) return i;
      tick();
    }
    return -1;
  }
  bool enabled() const { return feedback.state == DriveState::kEnabled; }
  void start() {
    drives.bring_up();
    ASSERT_GE(until([&] { return enabled(); }, kReady), 0) << drives.explain_fault(-1);
  }
  void home() {
    const unsigned all = (1u << machine_.joints.size()) - 1;
    drives.request_home(all);
    tick();
    ASSERT_GE(until([&] { return enabled() && feedback.homed_mask == all; }, 40000), 0)
        << drives.explain_fault(-1);
    settle();
  }
  void settle() {
    for (int i = 0; i < 300; ++i) tick();
  }
  /// As the daemon's reset.
  void reset() {
    drives.reset_faults();
    drives.bring_up();
  }
  double period_s() const { return machine_.period_s; }
  EmulatedNode& node(int index) { return drives.node(0, static_cast<std::size_t>(index)); }
  VirtualBus& bus() { return drives.bus(0); }
  void trouble(int index, EmulatedNode::Trouble kind, std::int64_t value) {
    node(index).trouble(kind, value, bus().now_ns());
  }

 private:
  static ConfigTable edited(const std::string& path, const Edits& edits) {
    std::ifstream in(path);
    std::string text{std::istreambuf_iterator<char>(in), {}};
    for (const auto& [from, to] : edits)
      for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
    return parse_config(text, path);
  }

  Machine machine_;

 public:
  EmulatedCanDrives drives;
  Setpoints setpoints;
  Feedback feedback;
  int period = 0;
};

}  // namespace trn
