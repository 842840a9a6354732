#pragma once

#include <array>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/frames.h"
#include "core/ports.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/cutter/cutter_comp.h"
#include "interp/gcode/cutter/tangential_knife.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor/nurbs.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/measured_values.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/settings.h"
#include "interp/gcode/text/block.h"
#include "interp/gcode/tool_table.h"
#include "interp/gcode/work_frame.h"

namespace trn {

/// What stands outside the language: config, tables, machine, and where everything goes.
struct ExecutorParts {
  const ProgramConfig& config;
  Parameters& parameters;
  ToolTable& tools;
  const Kinematics* kinematics;  ///< may be null: no RTCP, all six words
  CanonSink& sink;
  std::function<void(std::uint32_t column, std::string_view text)> warn;
  bool asks = false;  ///< M6, M66 and G38 wait for `answer`; false: taken as met, contact at the move's end
};

/// What the machine answers to M6, M66 and G38; program coordinates and units.
struct MachineAnswer {
  double value = 0;              ///< of the input, -1: not in time; probe: 1 contact, 0 none
  ProgramWords contact, stands;  ///< after a probe move
};

/// Carries out one block: the dialect's order of execution, one handler a group (RS274/NGC section 3.8).
/// Handlers lie in the files named after what they do. Every handler throws BlockError.
class Executor : public StateValues {
 public:
  explicit Executor(const ExecutorParts& parts);

  /// Canonical functions that set the start state; `start` is where the machine stands (mm, degrees, in M).
  void begin(const MachineWords& start);
  /// After `begin`: takes over the modes of an earlier interpretation (units, planes, feed, path, tool,
  /// offsets, RTCP) with the canonical functions that set them. Spindle and coolant are in force as they
  /// were, but the machine is told of them only before something that hangs on them. Where the machine
  /// stands and a running canned cycle are not taken over.
  void resume(const Settings& kept);
  /// Gives the sink everything that stands for the present state (modes, tool, offsets) and an approach from
  /// where the machine really stands (mm, degrees, in M; with which tool) to the present place: up to the
  /// tool, and the rest of it when `tool_wait` is over. BlockError.
  void enter(const MachineWords& start, int in_spindle, const std::optional<EntryPlace>& on_move);
  void enter_rest();
  /// Gives the table the codes that the config adds.
  void map_words(ModalTable& table) const;
  /// Takes the words out of the block that [program] ignored passes over. BlockError.
  void drop_ignored(Block& block);
  /// True when the program has ended (M2, M30). A block with M6 is carried out up to the tool while there is
  /// a `tool_wait`, and the rest of it when that is over.
  bool execute(const Block& block);
  bool execute_rest(const Block& block);
  /// Until the tool is in the spindle: the machine's answer, or a call of the config's sub-program.
  enum class ToolWait : std::uint8_t { kNone, kAnswer, kCall };
  ToolWait tool_wait() const { return tool_wait_; }
  int incoming_tool() const { return incoming_tool_; }
  /// The sub-program has put it in.
  void end_tool_call(int number);
  /// Of that sub-program: the new tool, the old one, and their pockets; 0: no tool, or none in the table.
  std::array<double, 4> tool_call_arguments() const;
  /// After an error in between.
  void forget_tool_change();
  /// After the last block: nothing may be left waiting (cutter compensation).
  void finish();
  /// Questions to the machine that the last block has left open: as many answers, before the next block.
  int questions() const { return static_cast<int>(questions_.size()); }
  /// The first of them is whether the tool is in the spindle.
  bool asks_for_tool() const { return !questions_.empty() && questions_.front() == Question::kTool; }
  /// Answers the first of them.
  void answer(const MachineAnswer& answer);
  /// After a BlockError of `execute`: later blocks are read as if this one had been carried out, so that they
  /// tell errors of their own only.
  void pass_over(const Block& block);
  /// The gouges of the cutter compensation that the blocks so far have told, once.
  std::vector<GcodeReport> take_gouges();
  /// The implicit end at a closing % or at the end of the file.
  void end_program();

  double predefined(int index) const override;
  double position(int axis) const override;

  /// Lines that begin with '/' are skipped; at the beginning as the config has it.
  bool block_delete() const { return block_delete_; }
  void set_block_delete(bool on) { block_delete_ = on; }

  /// The line whose expressions are about to be computed.
  void at_line(std::uint32_t line, int file) {
    line_ = line;
    file_ = file;
  }

  /// While the program waits: a line of G10 or M61, carried out as if the machine stood at `stands`. Where it
  /// stands in the program does not change. The length of the tool in the spindle, if it is in force, is then
  /// that of the table. BlockError.
  void obey_held(const Block& b, const ProgramWords& stands);
  /// Offsets, tools and the tool in the spindle, in place of what a line has just set. The machine does not
  /// move; a length in force is that of the spindle's tool again.
  void set_measured(const MeasuredValues& measured);
  /// After `obey_held`: offsets, tool and lengths are again as in `kept`.
  void put_back(const Settings& kept);

  const Settings& settings() const { return s_; }
  /// Of the block that is being carried out: its settings have it only behind it.
  GCode motion_now() const { return motion_now_; }
  GCode cutter_comp_code() const { return !comp_.active() ? 40_g : comp_.left() ? 41_g : 42_g; }
  /// So many sub-programs are open: #<_call_level>, and the level at which M70 and M73 keep the modes.
  void set_call_level(int level) { call_level_ = level; }
  /// A sub-program returns, with a value or without: #<_value> and #<_value_returned>.
  void set_return_value(std::optional<double> value) { return_value_ = value; }
  void warn(std::uint32_t column, std::string_view text) const { parts_.warn(column, text); }
  /// Nothing of the program is half done: no compensated contour, no open curve.
  bool between_features() const {
    return !comp_.active() && !s_.knife && !in_nurbs_ && !in_rational_ && !spline_chained_ && !left_contour_;
  }
  /// M70/M73 bookkeeping: `level` is the sub-program depth.
  void on_return(int level);

 private:
  // executor.cc: order of execution
  void check_unused(const Block& b, GCode motion) const;
  std::uint32_t used_letters(const Block& b, GCode motion) const;
  GCode motion_of(const Block& b) const;
  static bool only_sets_mode(const Block& b);
  void check_open_curve(const Block& b, GCode motion) const;
  bool other_axis_code(const Block& b) const;
  void check_g53(const Block& b) const;
  void g_codes(const Block& b);
  void motion_code(const Block& b, GCode motion);
  void comment(const Block& b);
  double predefined_mode(int index) const;
  double predefined_place(int index) const;
  std::string expand_message(const std::string& text) const;
  void put(const CanonCommand& command);
  void put_now(const CanonCommand& command);
  void put(PlainCanon what) { put(canon::Plain{what}); }
  void note(std::string_view text) { put(canon::Comment{text}); }

  // modes.cc: settings that move nothing
  void feed_mode(const Block& b);
  void set_feed_mode(FeedMode mode);
  void feed(const Block& b);
  void spindle_mode(const Block& b);
  void speed(const Block& b);
  void plane(const Block& b);
  void units(const Block& b);
  void set_units(bool inch);
  void path_mode(const Block& b);
  void set_great_circle(bool on);
  void set_path(MotionControl mode, double tolerance, double naive, double orientation_deg);
  void put_path();
  void distance(const Block& b);
  void set_incremental(bool incremental);
  void set_arc_absolute(bool absolute);
  void set_diameter(bool diameter);
  void retract(const Block& b);
  void set_retract(bool to_start);
  void dwell(const Block& b);
  void warn_long_dwell(const Block& b, std::string_view name);

  // mcodes.cc
  void m_codes(const Block& b);
  void tool_select(const Block& b);
  void tool_change(const Block& b);
  void ask_for_tool(int number);
  void tool_is_in(int number);
  int spindle_tool() const;
  void check_tool(int number, std::uint32_t column) const;
  [[noreturn]] void unknown_tool(int number, std::uint32_t column) const;
  int slot_of(int number) const;
  void spindle(const Block& b);
  void start_spindle(SpindleTurn turn);
  void stop_spindle();
  void tell_spindle();
  void tell_coolant();
  void coolant(const Block& b);
  void overrides(const Block& b);
  void output(const Block& b);
  void modal_state(const Block& b);
  void take_over(const Settings& kept);
  void restore_modal(const Settings& state);
  void restore_feed(const ModalState& kept);
  void restore_geometry(const Settings& state);
  void restore_spindle(SpindleTurn turn);
  void restore_coolant(const ModalState& kept);
  void restore_overrides(const ModalState& kept);
  void restore_tool_length(const Settings& kept);
  void user_m(const Block& b);
  void restore_switches(const Settings& kept);
  struct Kept;
  void restore(const Kept& kept);
  void retract_to_safe_height();
  bool stop(const Block& b);
  void reset_at_end();
  void keywords(const Block& b);

  // ignored_words.cc
  void drop_words(Block& b, std::size_t index, std::uint32_t column, std::uint32_t kept);

  // offsets.cc
  void tool_length(const Block& b);
  bool length_is_of_spindle_tool() const;
  void set_tool_offset(const ProgramWords& offset, GCode code);
  ProgramWords table_offset(int tool, std::uint32_t column) const;
  void work_offset(const Block& b);
  void g10(const Block& b, bool by_hand);
  void g10_tool(const Block& b, int l, bool by_hand);
  Tool& table_entry(const Block& b, bool by_hand);
  void g10_system(const Block& b, int l);
  void g92(const Block& b);
  void g52(const Block& b);
  void set_g92_active(bool active);
  void restore_g92(bool active);
  void home_position(const Block& b, GCode code);
  void load_system(int index);
  void take_spindle_length();
  void put_system(bool with_g92);
  WorkFrame frame() const;
  /// What a tool offset takes from the words while RTCP is off: it lies along the spindle at home.
  ProgramWords in_words(ProgramWords tool_offset) const;
  bool head_is_tilted() const;
  /// Axis coordinates with the tool offset added: where the machine itself stands, mm and degrees.
  MachineWords machine_now(std::uint32_t column) const;
  /// Runs `change` on the offsets and keeps the machine where it is.
  template <typename Change>
  void keep_machine(const Change& change);

  // rtcp.cc: tool-centre-point control, tilted plane
  static void check_tool_angles(const ProgramWords& offset, std::uint32_t column, std::string_view word);
  void set_rtcp(bool on, const ProgramWords& tool_offset, std::uint32_t column, std::string_view word);
  void tilted_plane(const Block& b);
  void square_to_tool(const Block& b);
  void cancel_tilted_plane();
  void tilt(const Vec3& origin, const Mat3& R_tilt);
  void align_tool(const Block& b);
  void obey_plane(std::uint32_t column);
  Pose spindle_pose(std::uint32_t column, std::string_view word) const;
  ProgramWords position_for(const Pose& X_BS, bool tip_in_table, std::uint32_t column,
                            std::string_view word) const;
  ProgramWords vector_target(const Block& b, const ProgramWords& to) const;
  bool tip_in_table() const { return s_.rtcp || s_.tilted_aligned; }
  void suspend_rtcp(const Block& b, const std::function<void()>& move);
  Vec3 orientation_abc_rad(const ProgramWords& program) const;

  // motion.cc
  ProgramWords target(const Block& b) const;
  ProgramWords machine_target(const Block& b) const;
  void polar(const Block& b, double& x, double& y) const;
  void check_polar_plane(const Block& b) const;
  double wrapped(double to, double from) const;
  double wrapped_word(const Block& b, char letter, double from) const;
  void check_feed(const Block& b, std::string_view what) const;
  void straight(const Block& b, GCode motion);
  void put_straight(const Block& b, const ProgramWords& to, bool traverse);
  void probe(const Block& b, GCode motion);
  void probed(const MachineAnswer& answer);
  ProgramWords short_of(const ProgramWords& to) const;
  void set_motion_limits(double length, const Block& b);
  double inverse_rate(const Block& b) const;

  // threading.cc: geared to the spindle
  void spindle_synchronous(const Block& b, GCode motion);
  struct Thread;
  Thread thread_of(const Block& b) const;
  void threading_cycle(const Block& b);
  void thread_pass(const Thread& thread, double depth);

  // arc.cc
  double arc_tolerance_mm(double radius_mm) const;
  void arc(const Block& b, bool clockwise);
  void spline(const Block& b, GCode motion);
  void ignore_smoothing(std::uint32_t column);
  void cubic_spline(const Block& b);
  void quadratic_spline(const Block& b);
  void nurbs(const Block& b, GCode motion);
  void control_point(const Block& b);
  void rational_spline(const Block& b);
  void rational_point(const Block& b, bool tail, std::uint32_t column);
  void finish_rational(std::uint32_t column);

  // cycles.cc
  void cycle(const Block& b, GCode motion);
  struct CycleAxes;
  static CycleAxes cycle_axes(Plane plane);
  struct Hole;
  void cycle_word(const Block& b, GCode motion, char letter, double& kept);
  void cycle_words(const Block& b, GCode motion);
  [[noreturn]] void bad_peck(const Block& b, GCode motion) const;
  void check_peck(const Block& b, GCode motion, const Hole& hole) const;
  Hole first_hole(const Block& b, const CycleAxes& axes) const;
  void drill(const Block& b, GCode motion, Hole& hole, double height, int repeats);
  void cycle_hole(GCode motion, const Hole& hole);
  void cycle_to(const Hole& hole, double first, double second, double depth, bool traverse);
  void peck(const Hole& hole, bool full_retract);
  void tap(const Hole& hole, bool right_hand);
  void back_bore(const Hole& hole);
  void check_cycle_spindle(GCode motion, std::uint32_t column) const;
  void tilted_drilling(const Block& b);

  // comp_words.cc
  void cutter_comp(const Block& b);
  void comp_move(const Block& b, const CanonCommand& command);
  void flush_comp();

  // spindle_axis.cc
  void switch_spindle_axis(bool on);
  void check_spindle_axis(const Block& b, GCode motion, bool before) const;
  std::string spindle_axis_word(WordAction action) const;

  // knife.cc: tangential control
  void switch_knife(bool on, std::uint32_t column, std::string_view word);
  void check_knife(const Block& b, GCode motion) const;
  void check_knife_axis(std::uint32_t column, std::string_view word) const;
  void check_knife_read(int axis) const;

  bool has_axis(int axis) const { return axis_mask_ >> axis & 1U; }
  // Parameters keep offsets, and for G28 and G30 places of the machine.
  MmWords stored(int parameter) const;
  MachineWords stored_place(int parameter) const;
  void store(int parameter, const MmWords& words);
  void store(int parameter, const MachineWords& place);
  double to_mm(double length) const { return s_.modal.inch ? length * kMmPerInch : length; }
  double from_mm(double length) const { return s_.modal.inch ? length / kMmPerInch : length; }
  MmWords to_mm(const ProgramWords& words) const { return in_mm(words, s_.modal.inch); }
  ProgramWords from_mm(const MmWords& words) const { return in_program_units(words, s_.modal.inch); }

  TangentialKnife knife_;    ///< all that the executor puts goes by way of it
  bool knife_rtcp_ = false;  ///< it has switched RTCP on
  ExecutorParts parts_;
  unsigned axis_mask_;
  Settings s_;
  GCode motion_now_ = 80_g;
  std::uint32_t line_ = 0;
  int file_ = 0;  ///< as in BlockPlace
  struct Kept {
    Settings state;
    bool valid = false, restore_on_return = false, compensated = false;
  };
  std::vector<Kept> kept_;
  CutterComp comp_;
  ProgramWords spline_tangent_;  ///< end control of the last G5
  bool spline_chained_ = false;
  bool left_contour_ = false;  ///< since G40 no straight move: the tool is not where the program thinks
  struct NurbsPoint {
    double x, y, weight;
  };
  std::vector<NurbsPoint> nurbs_;
  bool in_nurbs_ = false;
  double nurbs_order_ = 3;
  double curve_rate_ = 0;  ///< inverse_rate of the line that G5.2 or G6.2 stands in
  NurbsCurve rational_;    ///< of G6.2, as far as it is known
  bool in_rational_ = false;
  enum class Question : std::uint8_t { kInput, kProbe, kTool };
  std::vector<Question> questions_;
  bool block_delete_ = false;
  std::vector<bool> warned_words_;
  bool warned_smoothing_ = false, warned_dwell_ = false;
  bool ignores_ = false;  ///< the config passes over some words
  ToolWait tool_wait_ = ToolWait::kNone;
  int incoming_tool_ = 0;
  bool in_tool_call_ = false;
  /// On, as the machine was told before this program.
  bool spindle_untold_ = false, coolant_untold_ = false;
  int call_level_ = 0;
  std::optional<double> return_value_;  ///< of the last sub-program that returned
  Settings entered_;                    ///< what `enter` goes to
  std::optional<EntryPlace> enter_at_;  ///< on the move that begins there; none: where it begins
  int spindle_slot_ = 1;  ///< of the tool in the spindle; the dialect begins with the table's first
};

template <typename Change>
void Executor::keep_machine(const Change& change) {
  const MachineWords machine = frame().to_machine(to_mm(s_.position));
  change();
  s_.position = from_mm(frame().to_program(machine));
}

}  // namespace trn
