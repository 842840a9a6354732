#include <fmt/format.h>

#include <cmath>

#include "core/axes.h"
#include "core/frames.h"
#include "core/ports.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/text/block.h"
#include "interp/gcode/work_frame.h"

// Tool-centre-point control and the tilted work plane. Both give the tip in the table frame; both are
// switched at rest and leave the machine where it stands, so that only the program's coordinates of that
// place change.
namespace trn {

namespace {

void check(KinStatus status, std::uint32_t column, std::string_view word) {
  if (status != KinStatus::kOk) fail(GcodeErrorCode::kUnreachable, column, word, to_string(status));
}

// Rotation about Z, X', Z'' by I, J, K: the Euler angles of G68.2.
Mat3 euler_zxz(double i_deg, double j_deg, double k_deg) {
  return rot_z(rad_from_deg(i_deg)) * rot_x(rad_from_deg(j_deg)) * rot_z(rad_from_deg(k_deg));
}

}  // namespace

Vec3 Executor::orientation_abc_rad(const ProgramWords& program) const {
  return in_radians(frame().to_machine(to_mm(program))).tail<3>();
}

// Pose of the spindle nose in the table frame at the present place.
Pose Executor::spindle_pose(std::uint32_t column, std::string_view word) const {
  const Kinematics& kinematics = *parts_.kinematics;
  const MachineWords machine = frame().to_machine(to_mm(s_.position));
  const Vec3 tool = to_mm(s_.tool_offset).xyz;
  // The words are the tip in the table, as they lie in M with every axis at zero; home_X_BM carries them to
  // B, and the tool leads from the tip to the spindle.
  if (tip_in_table()) {
    const Mat3 R_BS = kinematics.orientation(machine.abc_deg * kRadPerDeg);
    const Vec3 p_B = kinematics.home_X_BM() * machine.xyz;
    return {R_BS, p_B + R_BS * tool};
  }
  Words words = in_radians(machine);
  // With RTCP off the words are the axes less the tool offset, so adding it gives where the axes stand.
  words.head<3>() += kinematics.tool_in_words(tool);
  JointVec q;
  Pose X_BS;
  check(kinematics.joints_from_words(words, q), column, word);
  check(kinematics.forward(q, X_BS), column, word);
  return X_BS;
}

// Program coordinates of the pose under the present offsets; the rotary words stay.
ProgramWords Executor::position_for(const Pose& X_BS, bool tip_in_table, std::uint32_t column,
                                    std::string_view word) const {
  const Kinematics& kinematics = *parts_.kinematics;
  const Vec3 tool = to_mm(s_.tool_offset).xyz;
  const WorkFrame f = frame();
  MachineWords machine = f.to_machine(to_mm(s_.position));
  if (tip_in_table) {
    machine.xyz = inverse(kinematics.home_X_BM()) * (X_BS * Vec3(-tool));
  } else {
    Words seed_words = Words::Zero();
    seed_words.tail<3>() = machine.abc_deg * kRadPerDeg;
    JointVec seed, q;
    Words words;
    // a platform that cannot stand at zero has one solution, whatever the seed
    if (kinematics.joints_from_words(seed_words, seed) != KinStatus::kOk)
      seed = JointVec::Zero(kinematics.joint_count());
    check(kinematics.inverse(X_BS, seed, q), column, word);
    check(kinematics.words_from_joints(q, words), column, word);
    machine.xyz = words.head<3>() - kinematics.tool_in_words(tool);
  }
  ProgramWords program = from_mm(f.to_program(machine));
  // The inverse may give a rotary axis a whole turn or a rounding error more. The program's own angles are
  // kept: nothing has turned.
  program.abc_deg = s_.position.abc_deg;
  return program;
}

// Such an offset shifts the angles that the axes are told; the kinematics turns the tool by the axes' own.
void Executor::check_tool_angles(const ProgramWords& offset, std::uint32_t column, std::string_view word) {
  if (!offset.abc_deg.isZero(0))
    fail(GcodeErrorCode::kNotSupported, column, word, "with an offset of the tool in A, B or C");
}

void Executor::set_rtcp(bool on, const ProgramWords& tool_offset, std::uint32_t column,
                        std::string_view word) {
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, word);
  if (!parts_.kinematics || !(parts_.kinematics->word_mask() >> kA))
    fail(GcodeErrorCode::kNoRtcp, column, word);
  if (on == s_.rtcp && tool_offset == s_.tool_offset) return;
  if (on || s_.tilted_aligned) check_tool_angles(tool_offset, column, word);
  // Where the spindle stands under the old words. Then everything is switched, and the same pose is read off
  // under the new ones.
  const Pose X_BS = spindle_pose(column, word);
  const bool new_offset = tool_offset != s_.tool_offset;
  s_.rtcp = on;
  if (!on) s_.tool_vector = false;
  s_.tool_offset = tool_offset;
  s_.position = position_for(X_BS, tip_in_table(), column, word);
  if (new_offset) put(canon::UseToolLengthOffset{tool_offset});
  put(canon::SetRtcp{on, s_.position});
}

// Moves in axis coordinates (G53, G28, G30) are made with RTCP off, then it comes back.
void Executor::suspend_rtcp(const Block& b, const std::function<void()>& move) {
  const bool was_on = s_.rtcp;
  const bool vector = s_.tool_vector;
  const std::uint32_t column = b.at(GGroup::kNonModal);
  if (was_on) set_rtcp(false, s_.tool_offset, column, "G53");
  move();
  if (was_on) set_rtcp(true, s_.tool_offset, column, "G53");
  // Switching RTCP off forgot it.
  s_.tool_vector = vector;
}

MachineWords Executor::machine_now(std::uint32_t column) const {
  if (!tip_in_table()) return frame().to_machine(to_mm(s_.position)) + to_mm(in_words(s_.tool_offset));
  const Pose X_BS = spindle_pose(column, "the present place");
  MachineWords machine = frame().to_machine(to_mm(s_.position));
  const ProgramWords program = position_for(X_BS, false, column, "the present place");
  machine.xyz = frame().to_machine(to_mm(program)).xyz + to_mm(in_words(s_.tool_offset)).xyz;
  return machine;
}

// G68.2 X Y Z I J K defines the plane, G68.3 X Y Z R lays it square to the tool as it stands; G69 takes it
// away.
void Executor::tilted_plane(const Block& b) {
  const std::uint32_t column = b.at(GGroup::kTiltedPlane);
  if (b.code(GGroup::kTiltedPlane) == 69_g) {
    if (s_.tilted) cancel_tilted_plane();
    return;
  }
  const GCode code = b.code(GGroup::kTiltedPlane);
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, g_name(code));
  if (!parts_.kinematics) fail(GcodeErrorCode::kNoRtcp, column, g_name(code));
  if (s_.tilted)
    fail(GcodeErrorCode::kTiltedPlane, column, g_name(code) + " inside a tilted plane", "G69 first");
  if (b.has('P') && b['P'] != 0)
    fail(GcodeErrorCode::kBadValue, b.at('P'), 'P', b['P'], "G68.2", "P0 or none: Euler angles I J K");
  for (const char letter : {'A', 'B', 'C'})
    if (b.has(letter))
      fail(GcodeErrorCode::kTiltedPlane, b.at(letter), g_name(code) + " with a rotary word",
           "X Y Z and I J K or R");
  if (code == 68.3_g) return square_to_tool(b);
  tilt(Vec3(b.get('X', 0), b.get('Y', 0), b.get('Z', 0)),
       euler_zxz(b.get('I', 0), b.get('J', 0), b.get('K', 0)));
}

// Nothing turns: the plane's axes are those of the spindle as it stands over the table, turned by R about the
// tool. It is obeyed at once.
void Executor::square_to_tool(const Block& b) {
  check_tool_angles(s_.tool_offset, b.at(GGroup::kTiltedPlane), "G68.3");
  const Kinematics& kinematics = *parts_.kinematics;
  const Mat3 R_BP = kinematics.home_X_BM().R * frame().X_MP().R;
  const Mat3 R_BS = kinematics.orientation(orientation_abc_rad(s_.position));
  tilt(Vec3(b.get('X', 0), b.get('Y', 0), b.get('Z', 0)),
       R_BP.transpose() * R_BS * rot_z(rad_from_deg(b.get('R', 0))));
  obey_plane(b.at(GGroup::kTiltedPlane));
}

void Executor::tilt(const Vec3& origin, const Mat3& R_tilt) {
  const MachineWords machine = frame().to_machine(to_mm(s_.position));
  s_.tilted = true;
  s_.tilt_origin = origin;
  s_.R_tilt = R_tilt;
  s_.position = from_mm(frame().to_program(machine));
  put(canon::SetTiltedPlane{true, s_.tilted_aligned, s_.tilt_origin, s_.R_tilt, s_.position});
}

void Executor::cancel_tilted_plane() {
  const bool was_aligned = s_.tilted_aligned;
  Pose X_BS;
  // While the plane was obeyed the tip was what counted, as with RTCP. Otherwise the plane only renamed
  // coordinates.
  if (was_aligned) X_BS = spindle_pose(1, "G69");
  const MachineWords machine = frame().to_machine(to_mm(s_.position));
  s_.tilted = s_.tilted_aligned = false;
  s_.tilt_origin.setZero();
  s_.R_tilt.setIdentity();
  s_.position = was_aligned ? position_for(X_BS, s_.rtcp, 1, "G69") : from_mm(frame().to_program(machine));
  put(canon::SetTiltedPlane{false, false, s_.tilt_origin, s_.R_tilt, s_.position});
}

// G53.1 turns the rotary axes until the tool stands along the plane's Z; from then on the plane is obeyed.
void Executor::align_tool(const Block& b) {
  const std::uint32_t column = b.at(GGroup::kNonModal);
  if (!s_.tilted) fail(GcodeErrorCode::kTiltedPlane, column, "G53.1 without a tilted plane", "G68.2 first");
  if (s_.tilted_aligned) return;
  check_tool_angles(s_.tool_offset, column, "G53.1");
  const WorkFrame f = frame();
  const Vec3 u_B = parts_.kinematics->home_X_BM().R * f.X_MP().R * Vec3::UnitZ();
  Vec3 abc;
  check(parts_.kinematics->words_for_axis(u_B, orientation_abc_rad(s_.position), abc), column, "G53.1");
  // With RTCP off only the rotary axes turn, whatever the tip does; with it on, the tip stays.
  ProgramWords to = s_.position;
  to.abc_deg = abc * kDegPerRad - (f.g5x + f.g92).abc_deg;
  put(canon::StraightTraverse{to});
  s_.position = to;
  obey_plane(column);
}

void Executor::obey_plane(std::uint32_t column) {
  const Pose X_BS = spindle_pose(column, "G53.1");
  s_.tilted_aligned = true;
  s_.position = position_for(X_BS, true, column, "G53.1");
  put(canon::SetTiltedPlane{true, true, s_.tilt_origin, s_.R_tilt, s_.position});
}

// G43.5: I J K give the tool axis in program coordinates instead of rotary words.
ProgramWords Executor::vector_target(const Block& b, const ProgramWords& to) const {
  const Vec3 axis(b.get('I', 0), b.get('J', 0), b.get('K', 0));
  const std::uint32_t column = b.at(b.has('I') ? 'I' : b.has('J') ? 'J' : 'K');
  for (const char letter : {'A', 'B', 'C'})
    if (b.has(letter))
      fail(GcodeErrorCode::kRtcpState, b.at(letter), "a rotary word beside a tool vector",
           "I J K or rotary words");
  if (axis.norm() < 1e-9)
    fail(GcodeErrorCode::kRtcpState, column, "the tool vector I J K is zero", "a direction");
  const WorkFrame f = frame();
  const Vec3 u_B = parts_.kinematics->home_X_BM().R * f.X_MP().R * axis.normalized();
  Vec3 abc;
  check(parts_.kinematics->words_for_axis(u_B, orientation_abc_rad(s_.position), abc), column,
        "the tool vector");
  ProgramWords turned = to;
  turned.abc_deg = abc * kDegPerRad - (f.g5x + f.g92).abc_deg;
  return turned;
}

}  // namespace trn
