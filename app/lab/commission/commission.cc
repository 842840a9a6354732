#include "app/lab/commission/commission.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <utility>

#include "app/lab/commission/config_edit.h"
#include "app/lab/commission/joint_words.h"
#include "app/session/plausibility.h"
#include "core/config.h"
#include "core/fault.h"
#include "core/ports.h"
#include "core/safe_file.h"
#include "core/units.h"
#include "kernel/rt_messages.h"
#include "kinematics/factory.h"

namespace trn {

namespace {

using Json = nlohmann::ordered_json;

constexpr double kEnable_s = 20, kHome_s = 300, kSettle_s = 0.4;
constexpr double kScaleGood = 0.002;                        // share by which a ruler may be off
constexpr double kSlow = 0.1, kMiddle = 0.25, kFast = 0.8;  // of a joint's speed
constexpr double kHeld = 0.05;    // mm, deg: what an axis may sink until its brake holds
constexpr double kLagFactor = 3;  // following_error over what was seen

// A way that is easy to measure and has room on both sides of the machine's range; towards its middle.
double measuring_way(const Joint& joint, double place) {
  if (joint.endless) return 90 * kRadPerDeg;
  const double unit = unit_of_joint(joint), range = (joint.limit.max - joint.limit.min) / unit;
  double way = 10;
  for (const double wish : {20.0, 50.0, 100.0})
    if (wish < range / 4) way = wish;
  const bool up = place + way * unit <= joint.limit.max;
  return (up ? way : -way) * unit;
}

std::string first_word(const std::string& name) { return name.substr(0, name.find(' ')); }
std::string last_word(const std::string& name) { return name.substr(name.rfind(' ') + 1); }

}  // namespace

Commission::Commission(const Files& files, MakeMachine make, std::unique_ptr<CommissionMachine>& machine,
                       CommissionOperator& person)
    : files_(files),
      make_(std::move(make)),
      machine_(machine),
      person_(person),
      described_(read_machine(load_config(files.config))) {
  list_items();
  read_record();
}

void Commission::list_items() {
  const auto add = [&](const std::string& name) { items_.push_back({name, "", ""}); };
  const auto kinematics = make_kinematics(described_);
  add("figures");
  add("bus");
  add("identity");
  for (const Joint& joint : described_.joints) add("scale " + joint.name);
  for (int word = kX; word <= kC; ++word)
    if (kinematics->word_mask() >> word & 1u) add(fmt::format("direction {}", kWordLetters[word]));
  add("switches");
  add("homing");
  for (const Joint& joint : described_.joints) add("range " + joint.name);
  for (const Joint& joint : described_.joints) add("brake " + joint.name);
  for (const Joint& joint : described_.joints) add("following " + joint.name);
  for (const Joint& joint : described_.joints) add("tuning " + joint.name);
  add("spindle");
  add("probe");
  add("latency");
}

void Commission::read_record() {
  const std::string text = text_of_file(files_.record);
  if (text.empty()) return;
  const Json record = Json::parse(text, nullptr, false);
  if (record.is_discarded() || !record.contains("items"))
    throw std::runtime_error(files_.record + ": no record of a commissioning; remove it to begin anew");
  for (const Json& was : record["items"])
    for (CommissionItem& item : items_)
      if (was.value("name", "") == item.name && was.value("result", "") != "failed")
        item = {item.name, was.value("result", ""), was.value("note", "")};
}

void Commission::write_record() const {
  Json out = Json::array();
  for (const CommissionItem& item : items_)
    if (!item.result.empty())
      out.push_back({{"name", item.name}, {"result", item.result}, {"note", item.note}});
  write_file_safely(files_.record, Json{{"machine", described_.name}, {"items", out}}.dump(2) + "\n");
}

bool Commission::run() {
  for (CommissionItem& item : items_) {
    if (!item.result.empty()) continue;
    const Outcome outcome = perform(item.name);
    item.result = outcome.result;
    item.note = outcome.note;
    person_.tell(fmt::format("{}: {}{}{}", item.name, item.result, item.note.empty() ? "" : ", ", item.note));
    write_record();
    if (item.result == "failed") return false;
  }
  return true;
}

Commission::Outcome Commission::perform(const std::string& name) {
  const std::string what = first_word(name), of = last_word(name);
  int joint = 0;
  for (std::size_t i = 0; i < described_.joints.size(); ++i)
    if (described_.joints[i].name == of) joint = static_cast<int>(i);
  if (what == "figures") return ask_plausible();
  if (what == "bus") return check_bus();
  if (what == "identity") return identity();
  if (const std::string trouble = ready(); !trouble.empty()) return {"failed", trouble};
  if (what == "scale") return scale(joint);
  if (what == "direction") return direction(static_cast<int>(std::string_view(kWordLetters).find(of[0])));
  if (what == "switches") return limit_switches();
  if (what == "homing") return home();
  if (what == "range") return ends(joint);
  if (what == "brake") return brake(joint);
  if (what == "following") return following(joint);
  if (what == "tuning") return tuning(joint);
  if (what == "spindle") return spindle();
  return what == "probe" ? probe() : latency();
}

CommissionMachine& Commission::machine() {
  if (!machine_) machine_ = make_(feeds_forward_);
  return *machine_;
}

// Drives that have power, and no fault; "" or what is in the way.
std::string Commission::ready() {
  CommissionMachine& here = machine();
  const auto good = [](const CycleReport& report) {
    return report.drives == DriveState::kEnabled && report.fault == Fault::kOk &&
           report.motion == MotionState::kRest;
  };
  if (good(here.report())) return "";
  Drives& drives = *here.assembly().drives;
  try {
    drives.reset_faults();
    drives.bring_up();
  } catch (const std::exception& error) {
    return error.what();
  }
  here.wait(0.05);
  here.post({RtCommand::Kind::kResetFault});
  if (here.until(good, kEnable_s)) return "";
  const std::string why = drives.explain_fault(-1);
  return why.empty() ? fmt::format("the drives do not get ready ({})", fault_info(here.report().fault).name)
                     : why;
}

// Each joint by its way, together; "" or the fault.
std::string Commission::move(const JointVec& way, double share) {
  CommissionMachine& here = machine();
  double longest_s = 1;
  worst_lag_ = 0;
  for (Eigen::Index i = 0; i < way.size(); ++i) {
    const JointLimit& limit = here.assembly().machine.joints[static_cast<std::size_t>(i)].limit;
    if (way[i] == 0) continue;
    here.post({RtCommand::Kind::kJog, way[i], share * limit.velocity, static_cast<int>(i)});
    longest_s = std::max(longest_s, 2 + 2 * std::abs(way[i]) / (share * limit.velocity));
  }
  here.wait(0.1);
  const auto rests = [&](const CycleReport& report) {
    for (Eigen::Index i = 0; i < way.size(); ++i)
      if (way[i] != 0)
        worst_lag_ = std::max(worst_lag_, std::abs(report.q_setpoint[i] - report.q_measured[i]));
    return report.motion == MotionState::kRest || report.fault != Fault::kOk;
  };
  const bool rested = here.until(rests, longest_s);
  here.wait(kSettle_s);
  const CycleReport report = here.report();
  if (report.fault == Fault::kOk && rested) return "";
  const std::string why = here.assembly().drives->explain_fault(report.fault_joint);
  return why.empty() ? fmt::format("fault {}", fault_info(report.fault).name) : why;
}

// Whoever needs it next makes it anew.
void Commission::leave_machine() {
  if (machine_) {
    machine_->assembly().drives->shut_down();
    machine_->wait(1);
  }
  machine_.reset();
}

void Commission::change(const std::string& header, int number, const std::string& key,
                        const std::string& value) {
  change_text(with_key(text_of_file(files_.config), header, number, key, value));
}

// The machine is made anew: it has another config.
void Commission::change_text(const std::string& text) {
  const std::string before = text_of_file(files_.config);
  if (!std::filesystem::exists(files_.config + ".before"))
    write_file_safely(files_.config + ".before", before);
  write_file_safely(files_.config, text);
  leave_machine();
  described_ = read_machine(load_config(files_.config));
}

// Number of the joint's first [[drives.node]]; -1: its drives are no nodes.
int Commission::node_of(int joint) const {
  const std::vector<ConfigTable> nodes = described_.root.table("drives").tables_if("node");
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (nodes[i].text("joint") == described_.joints[static_cast<std::size_t>(joint)].name)
      return static_cast<int>(i);
  return -1;
}

Commission::Outcome Commission::ask_plausible() {
  std::string note;
  for (const std::string& question : implausible(described_, *make_kinematics(described_)))
    note += (note.empty() ? "" : "; ") + question;
  if (note.empty()) return {"good", "nothing to ask"};
  return person_.agrees("These figures are hardly right:\n" + note + "\nGo on with them?")
             ? Outcome{"good", "kept: " + note}
             : Outcome{"failed", note};
}

// Bring-up compares maker and product with the data sheet, and the drive's own limits with the joint's.
Commission::Outcome Commission::identity() {
  if (const std::string trouble = ready(); !trouble.empty()) return {"failed", trouble};
  std::string note;
  for (const std::string& warning : machine().assembly().drives->warnings())
    note += (note.empty() ? "" : "; ") + warning;
  const std::size_t nodes = described_.root.table("drives").tables_if("node").size();
  if (nodes == 0) return {"good", "the drives are ready"};
  return {"good",
          fmt::format("{} drives are those of their data sheets{}{}", nodes, note.empty() ? "" : "; ", note)};
}

Commission::Outcome Commission::scale(int joint) {
  const Joint axis = described_.joints[static_cast<std::size_t>(joint)];  // `change` reads the config anew
  const double unit = unit_of_joint(axis);
  const int node = node_of(joint);
  std::string changed;
  for (int attempt = 0; attempt < 3; ++attempt) {
    if (const std::string trouble = ready(); !trouble.empty()) return {"failed", trouble};
    const double way = measuring_way(axis, machine().report().q_setpoint[joint]);
    JointVec ways = JointVec::Zero(static_cast<Eigen::Index>(described_.joints.size()));
    ways[joint] = way;
    if (!person_.agrees(fmt::format("Joint {} will move by {:g} {}, slowly. Put a ruler or dial beside it.",
                                    axis.name, way / unit, unit_name_of(axis))))
      return {"failed", "left undone"};
    if (const std::string trouble = move(ways, kSlow); !trouble.empty()) return {"failed", trouble};
    const double seen = person_.measured(
        fmt::format("By how much did {} move, in {}?", axis.name, unit_name_of(axis)), joint);
    if (seen < 0.01) return {"failed", "it did not move: look at its coupling and its drive"};
    const double asked = std::abs(way / unit);
    if (std::abs(seen / asked - 1) <= kScaleGood)
      return {changed.empty() ? "good" : "changed",
              fmt::format("{}{:g} {} for {:g}", changed, seen, unit_name_of(axis), asked)};
    if (node < 0) return {"failed", fmt::format("it moves by {:g} instead of {:g}", seen, asked)};
    const std::string key = fmt::format("counts_per_{}", unit_name_of(axis));
    const double counts =
        described_.root.table("drives").tables("node")[static_cast<std::size_t>(node)].number(key);
    const std::string value = fmt::format("{:.7g}", counts * asked / seen);
    changed += fmt::format("{} {:g} -> {}; ", key, counts, value);
    const std::vector<ConfigTable> nodes = described_.root.table("drives").tables("node");
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (nodes[i].text("joint") == axis.name) change("[[drives.node]]", static_cast<int>(i), key, value);
  }
  return {"failed", changed + "and it still moves by another way"};
}

Commission::Outcome Commission::direction(int word) {
  std::string changed;
  for (int attempt = 0; attempt < 2; ++attempt) {
    if (const std::string trouble = ready(); !trouble.empty()) return {"failed", trouble};
    const Kinematics& kinematics = *machine().assembly().kinematics;
    const JointVec q = machine().report().q_setpoint;
    Words words;
    JointVec there;
    double way = word <= kZ ? 10 : rad_from_deg(10);
    const auto fits = [&](double step) {
      if (kinematics.words_from_joints(q, words) != KinStatus::kOk) return false;
      words[word] += step;
      if (kinematics.joints_from_words(words, there) != KinStatus::kOk) return false;
      for (std::size_t i = 0; i < described_.joints.size(); ++i) {
        const JointLimit& limit = described_.joints[i].limit;
        const auto k = static_cast<Eigen::Index>(i);
        if (there[k] != q[k] && (there[k] > limit.max || there[k] < limit.min)) return false;
      }
      return true;
    };
    if (!fits(way)) way = -way;
    if (!fits(way)) return {"failed", "there is no room to move it either way"};
    const char letter = kWordLetters[word], axis = "XYZ"[word % 3];
    const double shown = word <= kZ ? way : deg_from_rad(way);
    if (!person_.agrees(
            fmt::format("The word {} will go by {:g}. Watch the tool against the work.", letter, shown)))
      return {"failed", "left undone"};
    const JointVec ways = there - q;
    if (const std::string trouble = move(ways, kSlow); !trouble.empty()) return {"failed", trouble};
    const std::string question =
        word <= kZ ? fmt::format("Did the tool go towards +{} relative to the work?", axis)
                   : fmt::format("Did {} turn the positive way, as your programs mean it?", letter);
    if (person_.went_positive(question, word) == (way > 0))
      return {changed.empty() ? "good" : "changed", changed};
    int moved = -1, count = 0;
    for (Eigen::Index i = 0; i < ways.size(); ++i)
      if (std::abs(ways[i]) > 1e-9) moved = static_cast<int>(i), ++count;
    if (count != 1 || node_of(moved) < 0)
      return {"failed", "it goes the wrong way, and no single drive is to blame: look at [kinematics]"};
    const std::vector<ConfigTable> nodes = described_.root.table("drives").tables("node");
    const std::string name = described_.joints[static_cast<std::size_t>(moved)].name;
    for (std::size_t i = 0; i < nodes.size(); ++i)
      if (nodes[i].text("joint") == name)
        change("[[drives.node]]", static_cast<int>(i), "reverse",
               nodes[i].boolean("reverse", false) ? "false" : "true");
    changed = fmt::format("the motor of {} is reversed", name);
  }
  return {"failed", changed + ", and it still goes the wrong way"};
}

Commission::Outcome Commission::home() {
  if (!person_.agrees("All joints will look for their home positions.")) return {"failed", "left undone"};
  const std::uint64_t from = machine().report().period;
  if (const std::string trouble = homed(); !trouble.empty()) return {"failed", trouble};
  const double time_s =
      static_cast<double>(machine().report().period - from) * machine().assembly().machine.period_s;
  return {"good", fmt::format("all joints within {:.1f} s", time_s)};
}

// All joints home; "" or what is in the way.
std::string Commission::homed() {
  const unsigned all = (1u << described_.joints.size()) - 1;
  machine().post({RtCommand::Kind::kHome, 0, 0, -1});
  machine().wait(0.2);
  const bool done = machine().until(
      [&](const CycleReport& report) {
        return report.fault != Fault::kOk ||
               ((report.homed_mask & all) == all && report.motion == MotionState::kRest);
      },
      kHome_s);
  const CycleReport report = machine().report();
  if (done && report.fault == Fault::kOk) return "";
  const std::string why = machine().assembly().drives->explain_fault(report.fault_joint);
  return why.empty() ? fmt::format("fault {}", fault_info(report.fault).name) : why;
}

// A machine that was made anew may have forgotten where it is; "" or what is in the way.
std::string Commission::at_home() {
  const unsigned all = (1u << described_.joints.size()) - 1;
  if ((machine().report().homed_mask & all) == all) return "";
  if (!person_.agrees("The config has changed since the joints were homed. They will look for their home "
                      "positions again."))
    return "left undone";
  return homed();
}

Commission::Outcome Commission::ends(int joint) {
  const Joint& axis = described_.joints[static_cast<std::size_t>(joint)];
  if (axis.endless) return {"skipped", "it turns without an end"};
  if (const std::string trouble = at_home(); !trouble.empty()) return {"failed", trouble};
  const double unit = unit_of_joint(axis), margin = 0.01 * (axis.limit.max - axis.limit.min);
  if (axis.limit.max - axis.limit.min > 40 * kPi && axis.kind == JointKind::kRotary)
    return {"skipped", "its range is many turns"};
  if (!person_.agrees(fmt::format("Joint {} will go to both ends of its range, {:g} and {:g} {}.", axis.name,
                                  axis.limit.min / unit, axis.limit.max / unit, unit_name_of(axis))))
    return {"failed", "left undone"};
  const double back = machine().report().q_setpoint[joint];
  for (const double place : {axis.limit.min + margin, axis.limit.max - margin, back}) {
    JointVec ways = JointVec::Zero(static_cast<Eigen::Index>(described_.joints.size()));
    ways[joint] = place - machine().report().q_setpoint[joint];
    if (const std::string trouble = move(ways, kMiddle); !trouble.empty()) return {"failed", trouble};
  }
  return {"good", "both ends reached"};
}

Commission::Outcome Commission::brake(int joint) {
  const Joint& axis = described_.joints[static_cast<std::size_t>(joint)];
  bool fitted = false;
  if (const auto safety = described_.root.table_if("safety"))
    for (const ConfigTable& brake : safety->tables_if("brake")) fitted |= brake.text("joint") == axis.name;
  if (!fitted) return {"skipped", "none in [safety]"};
  if (!person_.agrees(fmt::format("The drives will be switched off. Does {} stay where it is?", axis.name)))
    return {"failed", "left undone"};
  const double before = machine().report().q_measured[joint];
  machine().assembly().drives->shut_down();
  machine().wait(2);
  const double sunk = std::abs(machine().report().q_measured[joint] - before) / unit_of_joint(axis);
  const std::string note = fmt::format("{} moved by {:.3f} {}", axis.name, sunk, unit_name_of(axis));
  if (sunk > kHeld) return {"failed", note + ": look at the brake, and at close_s of [[safety.brake]]"};
  return {"good", note};
}

Commission::Outcome Commission::following(int joint) {
  const Joint axis = described_.joints[static_cast<std::size_t>(joint)];  // `change` reads the config anew
  const double unit = unit_of_joint(axis), speed = kFast * axis.limit.velocity;
  if (const std::string trouble = at_home(); !trouble.empty()) return {"failed", trouble};
  // A third of a second at full speed, where there is room.
  const double room = axis.endless ? 4 * kPi : 0.3 * (axis.limit.max - axis.limit.min);
  const double length = std::min(room, speed / 3 + speed * speed / axis.limit.acceleration);
  if (!person_.agrees(fmt::format("Joint {} will move there and back by {:.0f} {} at {:.0f} % of its speed.",
                                  axis.name, length / unit, unit_name_of(axis), 100 * kFast)))
    return {"failed", "left undone"};
  double worst = 0;
  const bool up = axis.endless || machine().report().q_setpoint[joint] + length <= axis.limit.max;
  for (const double way : {up ? length : -length, up ? -length : length}) {
    JointVec ways = JointVec::Zero(static_cast<Eigen::Index>(described_.joints.size()));
    ways[joint] = way;
    if (const std::string trouble = move(ways, kFast); !trouble.empty()) return {"failed", trouble};
    worst = std::max(worst, worst_lag_);
  }
  // What is heard is older by the way of the frames, which is no lag of the drive.
  const double old =
      machine().assembly().drives->feedback_periods() * machine().assembly().machine.period_s * speed;
  const double lag = std::max(0.0, worst - old) / unit;
  const std::string note =
      fmt::format("lags by {:.3f} {} at {:.0f} % of its speed", lag, unit_name_of(axis), 100 * kFast);
  const int node = node_of(joint);
  if (node < 0) return {"good", note};
  const std::string key = fmt::format("following_error_{}", unit_name_of(axis));
  const ConfigTable table = described_.root.table("drives").tables("node")[static_cast<std::size_t>(node)];
  const double allowed = table.number(key, 0.0, kNotNegative), least = kLagFactor * lag;
  if (allowed > 0 && allowed >= least)
    return {"good", fmt::format("{}; {} = {:g} is enough", note, key, allowed)};
  const std::string value = fmt::format("{:.3g}", std::max(least, 0.1));
  const std::vector<ConfigTable> nodes = described_.root.table("drives").tables("node");
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (nodes[i].text("joint") == axis.name) change("[[drives.node]]", static_cast<int>(i), key, value);
  return {"changed", fmt::format("{}; {} {:g} -> {}", note, key, allowed, value)};
}

std::string Commission::protocol() const {
  std::string out = fmt::format(
      "# Commissioning of {}\n\nConfig: `{}`\n\n| item | result | what was found |\n|---|---|---|\n",
      described_.name, std::filesystem::path(files_.config).filename().string());
  for (const CommissionItem& item : items_)
    out += fmt::format("| {} | {} | {} |\n", item.name, item.result.empty() ? "not yet" : item.result,
                       item.note);
  return out;
}

}  // namespace trn
