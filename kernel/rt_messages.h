#pragma once

#include <array>
#include <cstdint>

#include "compensation/sensor_board.h"
#include "core/axes.h"
#include "core/check.h"
#include "core/fault.h"
#include "core/motion.h"
#include "core/ports.h"
#include "kernel/motion_queue.h"

// What the tick and the threads beside it say to each other; plain data, through rings.
namespace trn {

/// A command to the tick. It takes effect in the period in which the tick pops it.
struct RtCommand {
  enum class Kind : std::uint8_t {
    kStart,      ///< drive what the queue holds, from rest; value 1: MDI, which single block does not hold
    kHold,       ///< slow down on the path and stand
    kResume,     ///< go on after kHold or a program stop; the tool is in
    kStop,       ///< slow down on the path, then forget the ring's content
    kOverride,   ///< value: 0 to 2, of feed moves; above 1 where the joints' limits leave room
    kJog,        ///< joint moves by value (mm or rad) at speed (per s; 0: a tenth of its limit)
    kHome,       ///< joint, or -1: all
    kQuickStop,  ///< every drive brakes by its own ramp; forget the ring's content
    kEmergencyStop,    ///< the same, and latch the fault
    kCorrection,       ///< joint: number in the chain; value: 1 on, 0 off
    kResetFault,       ///< forget the latched fault
    kRapidOverride,    ///< value: 0 to 1, of rapid moves
    kSpindleOverride,  ///< value: 0 to 2
    kAdaptiveFeed,     ///< value: 0 to 1; a second override of feed moves, where M52 lets it act
    kSingleBlock,      ///< value 1: stand at the end of every line of the program until kResume; 0: no longer
    kOptionalStop,     ///< value 1: M1 stops; 0: it is passed
    kMachineLock,      ///< at rest; value 1: the plan runs, and the joints stay where they are
    kSpindle,          ///< while the motion stands in a hold: value rpm, + clockwise
    kCoolant,          ///< the same; joint: bits, 1 mist, 2 flood
    kDigitalOutput,    ///< the same; joint: number; value: 1 on, 0 off
    kRetrace,          ///< the same; value mm of the path, back or, > 0, forward (Retrace); 0: stop there
    kCount
  };
  Kind kind = Kind::kStart;
  double value = 0;
  double speed = 0;
  int joint = 0;
  std::uint32_t id = 0;  ///< counts up; returned in the reports
};

/// What the motion does in a period.
enum class MotionState : std::uint8_t {
  kRest,    ///< stands, and has nothing left to do
  kMoving,  ///< drives the ring's content, or waits for the planner, an input or the spindle
  kHeld,    ///< slows down to, or stands in, a hold
  kPaused,  ///< stands at a program stop (M0, M1), for a tool (M6), or behind a single block
  kJogging,
  kHoming,
};

/// What the operator does while the motion is held (HoldDetour, Retrace).
enum class DetourState : std::uint8_t {
  kNone,      ///< nothing: the machine stands where it was held
  kJogs,      ///< jogs move it away
  kAway,      ///< it stands, away or with outputs switched
  kReturns,   ///< it is on the way back, or held there
  kRetraces,  ///< it moves back along the path, or forward again (Retrace)
};

/// A correction of the chain in one period.
struct CorrectionReport {
  JointVec offset;  ///< what it adds to the plan's joints, mm or rad
  bool enabled = false;
  const char* warning = "";  ///< static text
};

/// What the tool suffers, by what the drives told in the period before; along joints X and Y (mm, N).
struct ToolLoadReport {
  Eigen::Vector2d force_N = Eigen::Vector2d::Zero();        ///< on the tool
  Eigen::Vector2d deflection_mm = Eigen::Vector2d::Zero();  ///< of its tip
  Eigen::Vector2d shift_mm = Eigen::Vector2d::Zero();       ///< of the path against it, in the setpoints
  bool known = false;  ///< false: no estimator, no current from the drives, or beyond what was learnt
  bool alarm = false;  ///< the load filter's model no longer fits the stage
};

/// What the tick reports, once a period.
struct CycleReport {
  std::uint64_t period = 0;
  JointVec q_plan, q_setpoint, q_measured;  ///< mm or rad; the setpoint is the plan with corrections
  std::array<CorrectionReport, kMaxSetpointCorrections> corrections;  ///< as many as the chain has
  SensorSample sensor;  ///< the reading that corrections heard in this period, if any
  ToolLoadReport tool_load;
  JointVec current_A;  ///< of the motors, mean of the period; empty: the drives do not tell
  JointVec force;      ///< of the joints' motors, N or Nm; empty: the drives do not tell
  JointVec velocity_offset, force_offset;  ///< as Setpoints has them; empty: no feed-forward
  std::array<DriveWords, kMaxJoints> words{};
  double wake_us = 0, tick_us = 0;    ///< how late the tick began; how long the one before took
  Words y = Words::Zero();            ///< path point, as in PathPiece
  MapContext context;                 ///< what y means
  bool on_path = false;               ///< y and context are those of a program's motion
  double speed_mm_s = 0;              ///< of the tip along the path
  double override_now = 1;            ///< rate of the motion
  double spindle_rpm = 0;             ///< with the spindle override; + clockwise
  int coolant = 0;                    ///< bits: 1 mist, 2 flood
  bool single_block = false;          ///< stands at the end of every line
  bool optional_stop = true;          ///< M1 stops
  bool machine_lock = false;          ///< the joints stay where they are
  bool planner_late = false;          ///< the motion is slower than asked for, for want of plan
  std::uint32_t line = 0, step = 0;   ///< as SourceLine, of what moves or happened last; 0: none
  std::uint32_t last_command_id = 0;  ///< of the last command that took effect
  std::uint32_t starvations = 0;      ///< since start
  std::uint32_t lost_reports = 0;     ///< since start: nobody took them in time
  bool rate_plan_late = false;        ///< the rate planner's answer was due and had not come
  std::uint32_t late_rate_plans = 0;  ///< since start: late by a time that a person may notice, in a motion
  std::uint32_t blocks_when_low = 0;  ///< of the program, seen by a tick with little ahead; else 0
  unsigned homed_mask = 0, limit_switch_mask = 0;
  int fault_joint = -1;
  Fault fault = Fault::kOk;   ///< latched
  CheckFailure failed_check;  ///< behind the fault `assertion`
  MotionState motion = MotionState::kRest;
  DetourState detour = DetourState::kNone;
  bool stands_in_hold = false;  ///< the operator may jog and switch
  bool detour_full = false;     ///< away by as many corners as can be led back
  double behind_mm = 0;         ///< so much of the path behind the place of the hold (Retrace)
  bool behind_end = false;      ///< and no farther that way
  QueueEvent event;             ///< the event that took effect in this period, if any
  QueueEvent waits_at;          ///< the event in front that is not done yet: a program stop, a tool, an input
  bool answered = false;        ///< `event` gave the program `answer`
  ProgramAnswer answer;
  std::uint64_t inputs = 0, outputs = 0;  ///< digital, bit i: number i
  bool probe = false;                     ///< contact
  bool spindle_ready = true;
  double spindle_turns = 0;    ///< of the encoder
  bool reads_encoder = false;  ///< the motion follows the encoder, or waits for its index
  double gear_lag_s = 0;       ///< of the path behind the spindle, plan time
  DriveState drives = DriveState::kOff;
};

/// What is written of every report, e.g. a trace file.
class ReportSink {
 public:
  virtual ~ReportSink() = default;
  virtual void write(const CycleReport& report) = 0;
  /// Instead of a report of a period in which the drives had no power.
  virtual void power_lost() {}
};

}  // namespace trn
