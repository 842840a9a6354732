#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "app/lab/commission/commission.h"
#include "app/lab/commission/commission_machine.h"
#include "app/lab/commission/config_edit.h"
#include "app/lab/commission/joint_words.h"
#include "app/lab/tune/tune_bode.h"
#include "app/lab/tune/tune_data.h"
#include "app/lab/tune/tune_fit.h"
#include "app/lab/tune/tune_plan.h"
#include "app/lab/tune/tune_report.h"
#include "app/lab/tune/tune_run.h"
#include "app/session/make_drives.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/fault.h"
#include "core/machine.h"
#include "core/ports.h"
#include "hal/can/can_config.h"
#include "hal/can/can_node_config.h"
#include "hal/can/sdo_talk.h"
#include "kernel/rt_messages.h"

// The items of the list that ask for a hand, a spindle or a measurement.
namespace trn {

namespace {

constexpr double kByHand_s = 30, kSpindleReady_s = 20, kSpindleSeen_s = 2, kStroke_s = 60, kLatency_s = 3;
constexpr double kHandRpm = 60;      // slow enough to be seen
constexpr double kModelGood = 0.05;  // share by which a figure of the model may be off
constexpr double kTuneRest_s = 0.15;

std::string ids_of(const std::vector<FoundNode>& nodes) {
  std::string out;
  for (const FoundNode& node : nodes) out += fmt::format("{}{}", out.empty() ? "" : ", ", node.id);
  return out.empty() ? "nobody" : out;
}

}  // namespace

// Who is on the buses, against who should be.
Commission::Outcome Commission::check_bus() {
  if (drives_type(described_) != "canopen") return {"skipped", "the drives are on no CAN bus"};
  const CanDrivesConfig config = read_can_drives(described_, described_.root.table("drives"));
  const std::vector<ScannedBus> found = machine().scan();
  std::string note;
  std::size_t known = 0;
  for (std::size_t b = 0; b < found.size(); ++b) {
    const std::vector<FoundNode>& nodes = found[b].nodes;
    const auto& wanted = config.buses[b].nodes;
    for (const CanNodeConfig& node : wanted) {
      const bool there = std::any_of(nodes.begin(), nodes.end(),
                                     [&](const FoundNode& one) { return one.id == node.link.id; });
      known += there;
      if (!there)
        return {
            "failed",
            fmt::format("{} does not answer; on {} there are: {}. Look at its supply, the cable and its "
                        "termination, the bit rate, its node id (trunnion can lss), and 'id' in the config",
                        node.link.name, found[b].interface, ids_of(nodes))};
    }
    for (const FoundNode& one : nodes)
      if (std::none_of(wanted.begin(), wanted.end(),
                       [&](const CanNodeConfig& node) { return node.link.id == one.id; }))
        note += fmt::format("; {} node {} is not in the config (vendor 0x{:X}, product 0x{:X})",
                            found[b].interface, one.id, one.vendor, one.product);
  }
  return {"good", fmt::format("{} nodes answer on {} buses{}", known, found.size(), note)};
}

// "" or what was wrong. Closed before anybody touches it, or for ever, it is wired or set wrong.
std::string Commission::by_hand(const std::string& what, HandStep step, int joint,
                                const std::function<bool(const CycleReport&)>& heard) {
  if (heard(machine().report()))
    return fmt::format(
        "{} is closed though nobody touches it: look at its wiring, and whether it opens or closes", what);
  if (!person_.does(fmt::format("Press {} by hand, within {:g} s, and hold it.", what, kByHand_s), step,
                    joint))
    return "left undone";
  if (!machine().until(heard, kByHand_s)) return fmt::format("{} was not heard", what);
  person_.lets_go(fmt::format("Heard. Let go of {}.", what));
  if (!machine().until([&](const CycleReport& report) { return !heard(report); }, kByHand_s))
    return fmt::format("{} stays closed when it is let go", what);
  return "";
}

namespace {
// With its switches swapped a drive would search its home point at the wrong end, and stop at none of them.
std::string wrong_end(const std::string& joint, HandStep step) {
  const bool negative = step == HandStep::kNegativeSwitch;
  return fmt::format(
      "the switch at the {0} end of {1} is heard as that of the {2} end: the two are swapped, or another one "
      "was pressed. Switch the drive off, swap the two wires at its inputs, and begin this item anew",
      negative ? "negative" : "positive", joint, negative ? "positive" : "negative");
}
}  // namespace

Commission::Outcome Commission::limit_switches() {
  std::string note;
  for (const ConfigTable& node : described_.root.table("drives").tables_if("node")) {
    if (!node.boolean("limit_switches", false)) continue;
    const std::string name = node.text("joint");
    int joint = 0;
    for (std::size_t i = 0; i < described_.joints.size(); ++i)
      if (described_.joints[i].name == name) joint = static_cast<int>(i);
    // Of a switch that is heard it is told which end its drive takes it for; the joint's direction is right
    // by now.
    unsigned ends = 0;
    const auto heard = [this, joint, &ends](const CycleReport& report) {
      if ((report.limit_switch_mask >> joint & 1u) == 0) return false;
      ends |= machine().assembly().drives->closed_ends(joint);
      return ends != 0;  // 0: it has bounced since
    };
    for (const HandStep step : {HandStep::kNegativeSwitch, HandStep::kPositiveSwitch}) {
      const std::string what = fmt::format("the switch at the {} end of {}",
                                           step == HandStep::kNegativeSwitch ? "negative" : "positive", name);
      ends = 0;
      if (const std::string trouble = by_hand(what, step, joint, heard); !trouble.empty())
        return {"failed", trouble};
      if (const unsigned right = step == HandStep::kNegativeSwitch ? 1 : 2; (ends & right) == 0)
        return {"failed", wrong_end(name, step)};
      if (ends == 3)
        return {"failed",
                what + " closes both inputs of its drive: look at its wiring, bits 0 and 1 of 0x60FD"};
      // A drive may take it for a fault, as it should.
      if (const std::string trouble = ready(); !trouble.empty()) return {"failed", trouble};
    }
    note += (note.empty() ? "" : ", ") + name;
  }
  return note.empty() ? Outcome{"skipped", "no drive has limit_switches = true"}
                      : Outcome{"good", "both heard, at the right ends, and let go: " + note};
}

Commission::Outcome Commission::probe() {
  const bool drives = described_.root.table("drives").text("probe", "none") == "drive";
  if (!described_.root.has("io") && !drives) return {"skipped", "the machine has no probe"};
  const std::string trouble =
      by_hand("the probe", HandStep::kProbe, -1, [](const CycleReport& report) { return report.probe; });
  if (trouble == "left undone") return {"skipped", trouble};
  return trouble.empty() ? Outcome{"good", "heard and let go"} : Outcome{"failed", trouble};
}

// The spindle at this speed, and what its encoder said in a while; "" or what is in the way.
std::string Commission::turn(double rpm, double& encoder_turns) {
  if (!machine().turn_spindle(rpm)) return "the machine takes no command for its spindle";
  machine().wait(0.1);
  const auto turns = [](const CycleReport& report) {
    return report.fault != Fault::kOk || (report.motion == MotionState::kRest && report.spindle_ready);
  };
  const bool came = machine().until(turns, kSpindleReady_s);
  const double from = machine().report().spindle_turns;
  if (rpm != 0) machine().wait(kSpindleSeen_s);
  const CycleReport report = machine().report();
  encoder_turns = report.spindle_turns - from;
  if (came && report.fault == Fault::kOk) return "";
  return report.fault != Fault::kOk ? std::string(fault_info(report.fault).meaning)
                                    : "the spindle does not get its speed";
}

Commission::Outcome Commission::spindle() {
  const bool is_axis = described_.root.has("spindle_axis");
  if (!is_axis && !described_.root.has("io"))
    return {"skipped", "the config has no spindle: no [io] and no [spindle_axis]"};
  std::string changed;
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (const std::string trouble = ready(); !trouble.empty()) return {"failed", trouble};
    if (!person_.agrees(
            fmt::format("The spindle will turn slowly, at {:g} rpm, clockwise seen from above (M3). Is it "
                        "empty, and is nobody near it?",
                        kHandRpm)))
      return {"failed", "left undone"};
    double turns = 0, none = 0;
    const std::string trouble = turn(kHandRpm, turns);
    const bool clockwise =
        trouble.empty() && person_.turned_clockwise("Does the spindle turn clockwise, seen from above?");
    const std::string stopped = turn(0, none);
    if (!trouble.empty() || !stopped.empty()) return {"failed", trouble.empty() ? stopped : trouble};
    const double expected = kHandRpm / 60 * kSpindleSeen_s;
    const std::string note =
        std::abs(turns) < 0.01
            ? "no encoder tells its turns"
            : fmt::format("encoder: {:.2f} turns in {:g} s at {:g} rpm", turns, kSpindleSeen_s, kHandRpm);
    if (clockwise && turns < -0.01)
      return {"failed",
              note + ": it counts the other way than the spindle turns; swap the tracks of the encoder"};
    if (clockwise && turns > 0.01 && std::abs(turns / expected - 1) > 0.2)
      return {"failed",
              fmt::format("{}, {:g} are expected: look at the counts of its encoder and at the inverter's "
                          "speed for an S word",
                          note, expected)};
    if (clockwise) return {changed.empty() ? "good" : "changed", changed + note};
    if (!is_axis)
      return {"failed",
              "it turns the other way: swap two phases of its motor, or what the inverter takes for forward"};
    const bool negative = described_.root.table("spindle_axis").text("m3", "negative") == "negative";
    change("[spindle_axis]", 0, "m3", negative ? "\"positive\"" : "\"negative\"");
    changed = fmt::format("m3 -> {}; ", negative ? "positive" : "negative");
  }
  return {"failed", changed + "and it still turns the other way"};
}

namespace {

/// What is written into the config's table of this joint, or "" where it is good as it is.
std::string with_model(const std::string& text, const Machine& machine, const Joint& joint,
                       const TuneResult& result) {
  const std::vector<ConfigTable> tables = machine.root.table("feed_forward").tables_if("joint");
  for (std::size_t i = 0; i < tables.size(); ++i) {
    if (tables[i].text("joint") != joint.name) continue;
    std::string out = text;
    bool differs = false;
    for (const TuneKey& key : tune_keys(result, joint)) {
      const double was = tables[i].has(key.name) ? tables[i].number(key.name, kAnyNumber) : 0;
      if (std::abs(was - key.value) <= std::max(kModelGood * std::abs(key.value), 3 * key.deviation))
        continue;
      differs = true;
      out = with_key(out, "[[feed_forward.joint]]", static_cast<int>(i), key.name,
                     fmt::format("{:.5g}", key.value));
    }
    return differs ? out : "";
  }
  return text + "\n" + tune_config(result, joint);
}

}  // namespace

// Without feed-forward: what the drive is told in advance holds for a period, and its loops answer to that
// within the period, so that the torque at its end is not the mean one.
Commission::Outcome Commission::tuning(int joint) {
  if (feeds_forward_ && described_.root.has("feed_forward")) {
    feeds_forward_ = false;
    leave_machine();
    if (const std::string trouble = ready(); !trouble.empty()) return {"failed", trouble};
  }
  if (const std::string trouble = at_home(); !trouble.empty()) return {"failed", trouble};
  const Joint axis = machine().assembly().machine.joints[static_cast<std::size_t>(joint)];
  const CycleReport now = machine().report();
  if (now.force.size() <= joint || !std::isfinite(now.force[joint]))
    return {"skipped", "its drive does not tell its torque ('torque = true' of the node)"};
  TuneResult result;
  try {
    const TunePlan plan = plan_tuning(axis, now.q_setpoint[joint], {});
    if (!person_.agrees(announcement(plan, axis))) return {"skipped", "left undone"};
    TuneRecorder recorder(machine().assembly().machine.period_s,
                          machine().assembly().drives->feedback_periods(), joint);
    machine().watch([&](const CycleReport& report) { recorder.take(report); });
    std::string trouble;
    for (std::size_t i = 0; i < plan.strokes.size() && trouble.empty(); ++i) {
      recorder.begin(static_cast<int>(i));
      trouble = stroke(joint, plan.strokes[i]);
    }
    machine().watch(nullptr);
    if (!trouble.empty()) return {"failed", trouble};
    const TuneData data = recorder.take_data();
    result.fit = fit_joint(data, axis);
    result.lost_motion = lost_motion(data, result.fit, plan.first_slow);
    result.loop = measure_loop(data, result.fit, axis);
  } catch (const std::runtime_error& error) {
    machine().watch(nullptr);
    return {"failed", error.what()};
  }
  const std::string note = tune_line(result, axis);
  if (!described_.root.has("feed_forward"))
    return {"good", note + "; the config has no [feed_forward] that could take it"};
  const std::string text = with_model(text_of_file(files_.config), described_, axis, result);
  if (text.empty()) return {"good", note};
  change_text(text);
  return {"changed", note + "; written into [feed_forward]"};
}

// One way there; "" or the fault.
std::string Commission::stroke(int joint, const TuneStroke& stroke) {
  machine().post({RtCommand::Kind::kJog, stroke.way, stroke.speed, joint});
  machine().wait(0.05);
  const bool rests = machine().until(
      [](const CycleReport& report) {
        return report.motion == MotionState::kRest || report.fault != Fault::kOk;
      },
      kStroke_s);
  machine().wait(kTuneRest_s);
  const CycleReport report = machine().report();
  if (rests && report.fault == Fault::kOk) return "";
  const std::string why = machine().assembly().drives->explain_fault(report.fault_joint);
  return why.empty() ? fmt::format("fault {}", fault_info(report.fault).name) : why;
}

Commission::Outcome Commission::latency() {
  if (const std::string trouble = ready(); !trouble.empty()) return {"failed", trouble};
  const double latest_us = machine().latest_us(kLatency_s), period_us = 1e6 * described_.period_s;
  const std::string note = fmt::format("latest wake-up and longest tick together {:.0f} us of {:.0f}, {}",
                                       latest_us, period_us, machine().clock());
  // The rehearsal's process has no real-time priority, and its figure binds nobody.
  if (machine().rehearses()) return {"rehearsed", note};
  return {latest_us < 0.5 * period_us ? "good" : "failed", note};
}

}  // namespace trn
