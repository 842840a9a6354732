#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "core/axes.h"
#include "core/fault.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/realtime.h"

// The sockets the parts plug into. Implementations live in the folder of their stage.
namespace trn {

/// Outcome of a kinematic computation; never a NaN.
enum class KinStatus : unsigned char { kOk, kUnreachable, kSingular, kLimit };
std::string_view to_string(KinStatus status);

/// A machine's geometry: motor joints <-> pose X_BS of the spindle nose S in the table frame B. Knows nothing
/// of tools, work offsets, corrections or drives. All functions are pure and may run in the tick.
class Kinematics {
 public:
  virtual ~Kinematics() = default;

  /// Number of motor joints.
  virtual int joint_count() const TRN_RT = 0;

  /// Bit i set: the machine obeys program word i (kX .. kC).
  virtual unsigned word_mask() const TRN_RT = 0;

  /// Pose X_BM of the machine frame M in the table frame B: M lies where the gauge point stands with every
  /// word at zero. With RTCP on a program is written in M as it lies then; p_B = X_BM * p_M.
  virtual Pose home_X_BM() const TRN_RT = 0;

  /// Orientation R_BS that the rotary words (rad, in order A B C, through each axis' sense) ask for.
  virtual Mat3 orientation(const Vec3& abc) const TRN_RT = 0;

  /// Rotary words that point the tool axis along the unit vector u_B (from the tip towards the spindle), the
  /// solution nearest to `seed_abc` (branch and turn); at a pole the free word keeps its seed.
  virtual KinStatus words_for_axis(const Vec3& u_B, const Vec3& seed_abc, Vec3& abc) const TRN_RT = 0;

  /// Joints -> pose. Closed form or a bounded iteration from `seed` (joint-space machines ignore it).
  virtual KinStatus forward(const JointVec& q, Pose& X_BS) const TRN_RT = 0;

  /// Pose -> joints, the solution nearest to `seed`. A machine that does not control the turn about the tool
  /// uses only R_BS's third column. If the seed's rotary joints already give the orientation, they are kept
  /// to the bit. Position limits are not judged here; kLimit means a limit of the mechanism itself (a leg's
  /// joint angle).
  virtual KinStatus inverse(const Pose& X_BS, const JointVec& seed, JointVec& q) const TRN_RT = 0;

  /// RTCP on: the rotary words abc (rad), the tip p_BT and the tool offset (mm) -> the spindle's pose and the
  /// joints, as orientation, X_BS = {R, p_BT + R tool_offset} and inverse from `seed` in turn.
  virtual KinStatus joints_at_tip(const Vec3& abc, const Vec3& p_BT, const Vec3& tool_offset,
                                  const JointVec& seed, Pose& X_BS, JointVec& q) const TRN_RT {
    const Mat3 R = orientation(abc);
    X_BS = {R, p_BT + R * tool_offset};
    return inverse(X_BS, seed, q);
  }

  /// RTCP off: the machine's own axes, as words (mm, rad; no tool), to joints and back. Serial machines:
  /// joint by joint through each axis' sense. Parallel machines: pose of the platform.
  virtual KinStatus joints_from_words(const Words& words, JointVec& q) const TRN_RT = 0;
  virtual KinStatus words_from_joints(const JointVec& q, Words& words) const TRN_RT = 0;
  /// RTCP off: what a tool offset (mm) takes from X Y Z of those words. It lies along the spindle as it
  /// stands with every rotary word at zero: along Z, unless the head is tilted for good.
  Vec3 tool_in_words(const Vec3& tool_offset) const TRN_RT { return orientation(Vec3::Zero()) * tool_offset; }
  /// Each of those words is one joint's place: a straight move of the words is a straight move of the joints,
  /// so that its ends tell whether it stays in the joints' ranges. A machine that does not say so has its
  /// moves looked at all along.
  virtual bool words_are_joints() const TRN_RT { return false; }
};

/// The whole joint map, path point to motor joints, one pure function used by the planner (limits) and the
/// tick (setpoints), so that they cannot disagree.
class JointMap {
 public:
  virtual ~JointMap() = default;
  virtual int joint_count() const TRN_RT = 0;
  /// y as in PathPiece; q in mm / rad.
  virtual KinStatus map(const Words& y, const MapContext& context, JointVec& q) const TRN_RT = 0;
};

/// A correction inside the plan that knows the machine's true geometry: which joints make the actual machine
/// reach the pose that nominal joints stand for? Pure; planner and tick hold the same object.
class PoseCorrection {
 public:
  virtual ~PoseCorrection() = default;
  /// q: the nominal joints of X_BS (mm, rad) in, those of the actual machine out. kLimit: the correction
  /// would be larger than its own limit.
  virtual KinStatus correct(const Pose& X_BS, const Vec3& tool_offset, JointVec& q) const TRN_RT = 0;
  /// Where the actual machine stands at joints q.
  virtual KinStatus actual(const JointVec& q, Pose& X_BS) const TRN_RT = 0;
};

/// A correction inside the plan that acts on each joint alone. Pure.
class JointCorrection {
 public:
  virtual ~JointCorrection() = default;
  virtual void correct(JointVec& q) const TRN_RT = 0;
  /// The inverse of `correct`.
  virtual void undo(JointVec& q) const TRN_RT = 0;
};

/// The most corrections of this kind that a machine may have.
inline constexpr int kMaxSetpointCorrections = 4;

struct CorrectionInput;

/// A correction that time enters (temperature, force, direction of motion): not in the plan, added to the
/// plan's joints in every period out of the share of the limits that the planner keeps free for it
/// (SetpointChain). It may ask for anything; what it gets is bounded, rate-limited and jerk-smooth.
class SetpointCorrection {
 public:
  virtual ~SetpointCorrection() = default;
  /// The offset wanted now on every joint, mm or rad; called once a period, also while switched off.
  virtual void wanted(const CorrectionInput& input, JointVec& offset) TRN_RT = 0;
  /// Bit i: acts on joint i.
  virtual unsigned joint_mask() const = 0;
  /// 0: the offset passes a smoothing filter on its way to the joint. Otherwise it is a smooth function of
  /// the joint's position, |d offset / d q| at most this, that is passed on as it is: no lag behind the axis.
  virtual double slope_max() const TRN_RT { return 0; }
  /// What the operator should know, e.g. a sensor that is missing; a static text, "" if all is well.
  virtual const char* warning() const TRN_RT { return ""; }
};

/// What the drives are told and what they answer, once a period.
struct Setpoints {
  JointVec q, qd;  ///< mm or rad, per s; motor joints after all corrections
  /// Feed-forward, at the moment at which q acts: mm or rad per s, and N or Nm of the joint; zeros or empty
  /// without.
  JointVec velocity_offset = {}, force_offset = {};
  std::array<std::uint32_t, kMaxJoints>
      outputs{};  ///< of each joint's drive, as 0x60FE has them, beside brakes
};

enum class DriveState : unsigned char { kOff, kStarting, kEnabled, kHoming, kQuickStop, kFault, kLost };

/// What a drive and its master last said to each other (CiA 402-2); 0 where a drive has no such words.
struct DriveWords {
  std::uint16_t status = 0, control = 0;
};

/// Digital outputs that no program may switch.
struct HeldOutputs {
  std::uint64_t mask = 0, on = 0;
};

struct Feedback {
  JointVec q;          ///< measured position
  JointVec current_A;  ///< motor current, mean of the period; empty: the drives do not tell
  JointVec force;      ///< of the joint's motor, N or Nm; empty: the drives do not tell
  std::array<DriveWords, kMaxJoints> words{};  ///< by joint
  DriveState state = DriveState::kOff;         ///< the worst of all joints
  Fault fault = Fault::kOk;
  int fault_joint = -1;
  unsigned homed_mask = 0;                         ///< bit i: joint i knows its position
  unsigned limit_switch_mask = 0;                  ///< bit i: joint i stands on a limit switch
  std::array<std::uint32_t, kMaxJoints> inputs{};  ///< of each joint's drive, as 0x60FD has them
  unsigned inputs_heard_mask = 0;                  ///< bit i: joint i's drive has told its inputs
  HeldOutputs held;                                ///< outputs of [io] that only the drives switch: brakes
};

struct CorrectionInput {
  const JointVec& q;         ///< the plan's joints in this period, mm or rad
  const Feedback& feedback;  ///< of the last period
};

/// The most digital and the most analog inputs and outputs of each kind.
inline constexpr int kMaxIo = 64;

/// What the devices beside the drives are told, once a period.
struct IoOutputs {
  std::uint64_t digital = 0;            ///< bit i: output i (M62 to M65)
  std::array<double, kMaxIo> analog{};  ///< M67, M68
  double spindle_rpm = 0;               ///< signed, + clockwise
  bool spindle_orients = false;         ///< M19: stand at spindle_deg
  double spindle_deg = 0;
  int coolant = 0;  ///< bits: 1 mist, 2 flood
};

/// What they answer.
struct IoInputs {
  std::uint64_t digital = 0;            ///< bit i: input i (M66 P)
  std::array<double, kMaxIo> analog{};  ///< M66 E
  bool probe = false;                   ///< contact
  bool spindle_ready = true;            ///< turns as told, or stands as told
  double spindle_turns = 0;             ///< the encoder, + clockwise; whole numbers at the index pulse
  Fault fault = Fault::kOk;
};

/// Where the machine is, for simulated devices; real ones know it without being told.
struct IoPlace {
  const JointVec& q;        ///< measured joints of the same period, mm or rad
  const Vec3& tool_offset;  ///< as in MapContext
};

/// Inputs and outputs of the machine beside its drives, real or simulated: what M62 to M68 and G38 mean, the
/// spindle and its encoder, coolant.
class MachineIo {
 public:
  virtual ~MachineIo() = default;
  /// Outside the tick; may take seconds; throw std::runtime_error with the device and the remedy.
  virtual void bring_up() {}
  /// Everything off.
  virtual void shut_down() noexcept {}
  /// In the tick, once a period behind the drives' exchange, bounded. Devices that take longer than a period
  /// work in a thread of their own; the inputs are then the last known ones.
  virtual void exchange(const IoOutputs& outputs, const IoPlace& place, IoInputs& inputs) TRN_RT = 0;
  /// Any thread: as Drives::explain_fault and Drives::health.
  virtual std::string explain_fault() const;
  virtual std::string health() const;
};

/// Servo drives, real or simulated.
class Drives {
 public:
  virtual ~Drives() = default;

  /// Outside the tick; may take seconds; throw std::runtime_error with node or register and the remedy.
  virtual void bring_up() = 0;
  virtual void shut_down() noexcept = 0;
  virtual void reset_faults() = 0;
  /// Any thread: the fault of a joint (-1: of any) in words, who, what and what would be right; "" if there
  /// is none or nothing is known beyond the fault's own text.
  virtual std::string explain_fault(int joint) const;
  /// Any thread: one line on how the bus does, "" if there is none.
  virtual std::string health() const;
  /// Any thread: what the last bring-up could not set and does without, a line each.
  virtual std::vector<std::string> warnings() const;
  /// Any thread: ends of a joint whose limit switches its drive says are closed, by the joint's direction:
  /// bit 0 negative, bit 1 positive.
  virtual unsigned closed_ends(int) const { return 0; }
  /// Periods from a setpoint to the feedback in which a drive without any lag would show it.
  virtual int feedback_periods() const { return 0; }
  /// False: simulated inside this process, where nothing moves.
  virtual bool real() const { return true; }

  /// In the tick, once a period, bounded. Between `home` and the homed bit the drive moves by itself and its
  /// setpoint is ignored.
  virtual void exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT = 0;
  virtual void request_home(unsigned joint_mask) TRN_RT = 0;
  virtual void quick_stop() TRN_RT = 0;
};

}  // namespace trn
