#include "app/import/config_writer.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "app/import/config_text.h"
#include "app/import/homing_reader.h"
#include "core/frames.h"

namespace trn {

namespace {

constexpr std::size_t kCommentWidth = 108;

/// Writes tables, keys and wrapped comments one after the other.
class ConfigText {
 public:
  explicit ConfigText(const ImportedMachine& machine) : machine_(machine) {}

  void comment(const std::string& text) {
    std::string line = "#";
    for (std::size_t at = 0; at < text.size();) {
      const std::size_t end = std::min(text.find(' ', at), text.size());
      if (line.size() > 1 && line.size() + 1 + end - at > kCommentWidth) {
        out_ += line + "\n";
        line = "#  ";
      }
      if (end > at) line += " " + text.substr(at, end - at);
      at = end + 1;
    }
    out_ += line + "\n";
  }
  void blank() { out_ += "\n"; }
  void line(const std::string& text) { out_ += text + "\n"; }
  void table(const std::string& name) { out_ += fmt::format("\n[{}]\n", name); }
  void tables(const std::string& name) { out_ += fmt::format("\n[[{}]]\n", name); }
  void number(const std::string& key, double value) { line(fmt::format("{} = {}", key, toml_number(value))); }
  void text(const std::string& key, const std::string& value) {
    line(fmt::format("{} = {}", key, toml_text(value)));
  }
  void vec3(const std::string& key, const Vec3& v) {
    line(fmt::format("{} = [{}, {}, {}]", key, toml_number(v.x()), toml_number(v.y()), toml_number(v.z())));
  }
  void texts(const std::string& key, const std::vector<std::string>& values) {
    std::string all;
    for (const std::string& value : values) all += (all.empty() ? "" : ", ") + toml_text(value);
    line(fmt::format("{} = [{}]", key, all));
  }
  void notes(ImportSpot spot, const std::string& joint = {}) {
    for (const ImportNote& note : machine_.notes)
      if (note.spot == spot && note.joint == joint) comment(note_line(beside_source(note)));
  }
  std::string take() { return std::move(out_); }

 private:
  // The first line of the config has the folder.
  ImportNote beside_source(ImportNote note) const {
    if (const std::string folder = folder_of(machine_.source); note.place.file.starts_with(folder))
      note.place.file.erase(0, folder.size());
    return note;
  }

  const ImportedMachine& machine_;
  std::string out_;
};

std::string unit_of(const ImportedJoint& joint) { return joint.rotary ? "deg" : "mm"; }

// With backlash the range is wider by what its correction keeps free of it: so programs reach the ends that
// LinuxCNC has.
void write_joint(const ImportedJoint& joint, double strip, ConfigText& out) {
  const std::string unit = unit_of(joint);
  out.tables("joint");
  out.notes(ImportSpot::kJoint, joint.name);
  out.text("name", joint.name);
  out.text("type", joint.rotary ? "rotary" : "linear");
  out.number("min_" + unit, joint.min - strip);
  out.number("max_" + unit, joint.max + strip);
  out.number("velocity_" + unit + "_s", joint.velocity);
  out.number("acceleration_" + unit + "_s2", joint.acceleration);
  out.number("jerk_" + unit + "_s3", joint.jerk);
}

void write_branch(const std::string& name, const std::vector<ImportedAxis>& axes, ConfigText& out) {
  for (const ImportedAxis& axis : axes) {
    out.tables("kinematics." + name);
    if (!axis.joint.empty()) {
      out.text("joint", axis.joint);
      out.vec3("direction", axis.direction);
    }
    if (axis.joint.empty() || axis.offset_mm != Vec3::Zero()) out.vec3("offset_mm", axis.offset_mm);
  }
}

void write_kinematics(const ImportedMachine& machine, ConfigText& out) {
  out.table("kinematics");
  out.comment(fmt::format("From {}.", machine.kinematics));
  out.notes(ImportSpot::kKinematics);
  if (!machine.hexapod) {
    out.text("type", "serial");
    write_branch("tool_branch", machine.tool_branch, out);
    write_branch("work_branch", machine.work_branch, out);
    return;
  }
  out.text("type", "hexapod");
  out.text("carries", "spindle");
  out.vec3("spindle_mm", machine.hexapod->spindle_mm);
  out.vec3("home_mm", machine.hexapod->home_mm);
  for (std::size_t i = 0; i < 6; ++i) {
    out.tables("kinematics.leg");
    out.vec3("base_mm", machine.hexapod->base_mm[i]);
    out.vec3("platform_mm", machine.hexapod->platform_mm[i]);
  }
}

void write_program(const ImportedMachine& machine, ConfigText& out) {
  out.table("program");
  out.notes(ImportSpot::kProgram);
  if (machine.programs_in_inch) out.text("units", "inch");
  if (!machine.path_mode.empty()) out.text("path_mode", machine.path_mode);
  if (machine.tolerance_mm) out.number("tolerance_mm", *machine.tolerance_mm);
  if (machine.arc_tolerance_mm) out.number("arc_tolerance_mm", *machine.arc_tolerance_mm);
  if (!machine.sub_path.empty()) out.texts("sub_path", machine.sub_path);
  if (!machine.wrapped.empty()) out.texts("wrapped", machine.wrapped);
  if (!machine.wrapped.empty()) out.text("wrapped_way", "sign");
  if (!machine.rtcp_on.empty()) out.texts("rtcp_on", machine.rtcp_on);
  if (!machine.rtcp_off.empty()) out.texts("rtcp_off", machine.rtcp_off);
  for (const ImportedCode& code : machine.codes) {
    out.tables("program.m_code");
    out.text("code", code.code);
    out.text("call", code.call);
  }
  if (machine.tolerance_mm.value_or(0) > 1) {
    out.table("planner");
    out.number("tolerance_mm_max", *machine.tolerance_mm);
  }
  out.table("tool_change");
  out.notes(ImportSpot::kToolChange);
  out.text("confirm", machine.tool_change == ImportedToolChange::kNobody ? "none" : "operator");
}

void write_backlash(const ImportedMachine& machine, ConfigText& out) {
  const double strip_mm = machine.backlash_strip(false), strip_deg = machine.backlash_strip(true);
  if (strip_mm == 0 && strip_deg == 0) return;
  out.table("corrections.joint_table");
  out.comment("BACKLASH of the joints; 'trunnion joint-table fit' finds it from measurements.");
  out.comment("A greater limit takes as much of the range at either end: make the joint's range wider then.");
  if (strip_mm > 0) out.number("limit_mm", strip_mm);
  if (strip_deg > 0) out.number("limit_deg", strip_deg);
  for (const ImportedJoint& joint : machine.joints) {
    if (joint.backlash == 0) continue;
    out.tables("corrections.joint_table.joint");
    out.text("joint", joint.name);
    out.number("backlash_" + unit_of(joint), joint.backlash);
  }
}

/// What a CANopen drive of this joint would need, as a comment to begin with.
void write_node(const ImportedJoint& joint, ConfigText& out) {
  const std::string unit = unit_of(joint);
  const auto number = [&](const std::string& key, double value) {
    out.line(fmt::format("# {} = {}", key, toml_number(value)));
  };
  const auto inside = [&](double at) { return at >= joint.min && at <= joint.max; };
  out.blank();
  out.line("# [[drives.node]]");
  out.line(fmt::format("# joint = {}", toml_text(joint.name)));
  if (joint.counts) {
    number("counts_per_" + unit, std::abs(*joint.counts));
    if (*joint.counts < 0) out.line("# reverse = true");
  }
  if (joint.following_error > 0) number("following_error_" + unit, joint.following_error);
  if (inside(joint.switch_at)) number("home_" + unit, joint.switch_at);
  if (inside(joint.home) && joint.home != joint.switch_at) number("home_final_" + unit, joint.home);
  if (joint.search_speed > 0)
    number("homing_speed_" + unit + "_s", std::min(joint.search_speed, joint.velocity));
  if (joint.latch_speed > 0)
    number("index_speed_" + unit + "_s", std::min(joint.latch_speed, joint.velocity));
}

void write_drive(const ImportedJoint& joint, double stand, const SimulatedHoming& homing, ConfigText& out) {
  const std::string unit = unit_of(joint);
  out.tables("drives.joint");
  if (joint.sequence)
    out.comment(fmt::format(
        "HOME_SEQUENCE = {}: 'trunnion home' finds all joints at once, 'trunnion home {}' this one; "
        "whatever starts the machine keeps the order.",
        *joint.sequence, joint.name));
  out.text("name", joint.name);
  out.number("start_" + unit, stand);
  out.number("home_" + unit, homing.home);
  out.number("index_distance_" + unit, homing.index_distance);
  if (joint.searches) out.line("homed = false");
  out.number("homing_speed_" + unit + "_s", homing.search_speed);
  out.number("index_speed_" + unit + "_s", homing.index_speed);
}

void write_drives(const ImportedMachine& machine, ConfigText& out) {
  constexpr double kUsualTimeout_s = 120, kLongestTimeout_s = 3600;
  out.table("drives");
  out.notes(ImportSpot::kDrives);
  out.comment(
      "Simulated drives, so that programs can be tried at once. They find a switch just below HOME and stand "
      "at HOME then. What CANopen drives (type = \"canopen\") would take from the INI stands below each "
      "joint; "
      "configs/cradle_can.toml has a whole machine of them.");
  out.text("type", "simulated");
  std::vector<double> stands;
  std::vector<SimulatedHoming> homings;
  double longest_s = 0;
  for (std::size_t i = 0; i < machine.joints.size(); ++i) {
    const ImportedJoint& joint = machine.joints[i];
    stands.push_back(inside_range(joint, machine.hexapod ? machine.hexapod->home_legs_mm[i] : joint.home));
    homings.push_back(simulated_homing(joint, stands[i], machine.period_s));
    if (joint.searches) longest_s = std::max(longest_s, search_time_s(joint, homings[i]));
  }
  if (longest_s > kUsualTimeout_s / 2)
    out.number("homing_timeout_s", std::min(std::ceil(2 * longest_s), kLongestTimeout_s));
  for (std::size_t i = 0; i < machine.joints.size(); ++i) {
    write_drive(machine.joints[i], stands[i], homings[i], out);
    write_node(machine.joints[i], out);
  }
}

bool has_notes(const ImportedMachine& machine, ImportSpot spot) {
  return std::any_of(machine.notes.begin(), machine.notes.end(),
                     [&](const ImportNote& note) { return note.spot == spot; });
}

void write_io(const ImportedMachine& machine, ConfigText& out) {
  if (machine.io) {
    out.table("io");
    out.notes(ImportSpot::kIo);
    out.text("type", "simulated");
    out.table("io.spindle");
    out.line(fmt::format("encoder = {}", machine.spindle_encoder));
    if (machine.spindle_rpm_max > 0) out.number("rpm_max", machine.spindle_rpm_max);
  } else if (has_notes(machine, ImportSpot::kIo)) {
    out.blank();
    out.notes(ImportSpot::kIo);
  }
  if (!has_notes(machine, ImportSpot::kEnd)) return;
  out.blank();
  out.comment("What has no place above:");
  out.notes(ImportSpot::kEnd);
}

}  // namespace

std::string note_line(const ImportNote& note) {
  return plain_text(fmt::format("{}: {}: {}; to do: {}", note.place.text(), note.what, note.why, note.to_do));
}

std::string config_text(const ImportedMachine& machine) {
  ConfigText out(machine);
  out.comment(
      plain_text(fmt::format("From {} by 'trunnion import linuxcnc'. Lengths are mm, angles degrees. A "
                             "comment that begins with a place of the "
                             "old files tells what was chosen, or not carried over, and what to do.",
                             machine.source)));
  out.table("machine");
  out.notes(ImportSpot::kMachine);
  out.text("name", machine.name);
  out.number("period_s", machine.period_s);
  for (const ImportedJoint& joint : machine.joints)
    write_joint(joint, joint.backlash > 0 ? machine.backlash_strip(joint.rotary) : 0, out);
  write_kinematics(machine, out);
  write_program(machine, out);
  write_backlash(machine, out);
  write_drives(machine, out);
  write_io(machine, out);
  return out.take();
}

}  // namespace trn
