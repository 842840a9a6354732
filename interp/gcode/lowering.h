#pragma once

#include <optional>
#include <vector>

#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/work_frame.h"
#include "interp/move.h"

namespace trn {

/// The program's coordinates of a place that is given in words, as in ProgramMove.
struct ProgramFrame {
  Pose X_TP;                    ///< program frame in the frame of the words
  Vec3 abc_deg = Vec3::Zero();  ///< offsets of the rotary words, which have no frame
  bool inch = false;            ///< the program's unit of length

  MmWords mm_of(const Words& words) const;
  ProgramWords program_of(const Words& words) const { return in_program_units(mm_of(words), inch); }
};

/// Turns canonical functions into moves in absolute words (mm, rad) for the planner: applies units and
/// offsets, puts the tip into the table frame while tool-centre-point control is on, and works out feed
/// limits.
///
/// RTCP on: p_B = X_BM * X_MP * p_P, with X_BM = Kinematics::home_X_BM() and X_MP the program frame in M
/// (WorkFrame). RTCP off: words = X_MP * p_P. X_WB in the context is the inverse of that placement.
class Lowering : public CanonSink {
 public:
  /// `kinematics` may be null for a machine without RTCP; `start` are the axis words where the machine
  /// stands, `corrections_off` as in MapContext.
  Lowering(const ProgramConfig& config, const Kinematics* kinematics, MoveSink& sink,
           const Words& start = Words::Zero(), std::uint8_t corrections_off = 0);

  void put(const CanonCommand& command, std::uint32_t line) override;

  /// After a probe move: the machine stands at these words (as in ProgramMove), not at the move's end.
  void stand_at(const Words& words) { words_ = words; }
  /// Such words in program coordinates and units.
  ProgramWords program_of(const Words& words) const { return frame().program_of(words); }
  ProgramFrame frame() const { return {X_TP_, offset_abc_deg(), inch_}; }
  /// What the words mean now.
  const MapContext& context() const { return move_.context; }

 private:
  struct Visit;

  MmWords in_words(MmWords tool) const;
  Words words_of(const ProgramWords& program) const;
  std::vector<Words> great_circle(const Words& to) const;
  bool on_great_circle(const Words& to, int parts, std::vector<Words>& way) const;
  void straight(const ProgramWords& to, ProgramMove::Kind kind, double inverse_per_min);
  void arc(const canon::ArcFeed& arc);
  void send_arc(const Words& to);
  bool parts_by_speed() const;
  std::vector<Words> line_parts(const Words& to) const;
  SurfaceSpeed surface_speed() const;
  double rpm_here() const;
  void tell_spindle();
  void spline(const canon::NurbsFeed& spline);
  double rpm_for(const Words& to) const;
  void limit_feed(double rpm);
  void send(const std::vector<Words>& way, double inverse_per_min);
  void send(const Words& to);
  void set_frame();
  void moved_frame(const ProgramWords& program);
  void switch_corrections(const SwitchCode& code);
  void event(QueueEvent::Kind kind, double value = 0, std::int32_t argument = 0);
  void probe(const canon::StraightProbe& probe);
  void wait_input(const canon::WaitInput& wait);
  void close_gear(const canon::StartFeedSync& gear);
  void open_gear();
  void tap(const canon::RigidTap& tap);
  void gear_event(GearMode mode, double turns_s);
  void output_bit(const canon::SetOutputBit& output);
  void output_value(const canon::SetOutputValue& output);
  Vec3 offset_abc_deg() const { return (frame_.g5x + frame_.g92 + tool_).abc_deg; }
  bool tip_in_table() const { return rtcp_ || aligned_; }

  const ProgramConfig& config_;
  const Kinematics* kinematics_;
  MoveSink& sink_;
  WorkFrame frame_;
  Pose X_TP_;          ///< program frame in the frame of the words (M, or B with RTCP on)
  bool plain_ = true;  ///< the frame is a shift only
  bool inch_ = false;
  MmWords tool_;
  bool rtcp_ = false, aligned_ = false;
  bool great_circle_ = false;
  double feed_ = 0;  ///< units of the program per minute, or per revolution
  bool per_revolution_ = false;
  double speed_ = 0;             ///< S: rpm, or in G96 m (feet) a minute
  double speed_unit_mm_ = 1000;  ///< of that m or foot
  double rpm_max_ = 0;           ///< of G96; 0: G97
  bool clockwise_ = true, turning_ = false;
  /// What the program has told. Before that the machine may have anything on, from a typed line.
  bool spindle_told_ = false, coolant_told_ = false;
  bool spindle_due_ = false;  ///< it has to be told anew before the next move
  bool traversed_ = false;    ///< the move before was one of G0
  bool geared_ = false;       ///< between the events that couple path and spindle
  double per_turn_ = 0;       ///< then: units of the program a turn
  double gear_rpm_ = 0;       ///< and the speed that was told
  int coolant_ = 0;
  /// canon::EnterArc, until the arc has come.
  struct Entered {
    Words from;
    double share = 0;
  };
  std::optional<Entered> entered_;
  Words words_;  ///< where the machine stands
  ProgramMove move_;
  OverrideMode overrides_;
};

}  // namespace trn
