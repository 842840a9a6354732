#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

/// Trunnion as a library: reads G-code, plans motions that keep every limit of a machine's joints, and knows
/// the machine's kinematics. Lengths are mm, angles rad, times s. Objects are not for several threads at
/// once.
///
///   trunnion::Machine machine("mill.toml");
///   trunnion::Motion motion = machine.plan_text("G1 X40 Y10 F1200\nG1 X0\nM2\n");
///   for (trunnion::Setpoint setpoint; motion.next(setpoint);) send(setpoint.position);
#pragma GCC visibility push(default)
namespace trunnion {

/// What is wrong with a config or a program, with its place and what would be right: "part.ngc:3:7: ...".
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// The places of the program words X Y Z (mm) A B C (rad), in this order.
using Words = std::array<double, 6>;

/// One move of a program, in absolute words, all offsets applied.
struct Move {
  enum class Kind : std::uint8_t { rapid, feed, arc };
  Kind kind = Kind::rapid;
  std::uint32_t line = 0;  ///< of the program, from 1
  Words from{}, to{};
  std::array<double, 3> arc_centre{}, arc_axis{};  ///< of an arc: mm, and a unit vector
  double arc_sweep_rad = 0;                        ///< right-handed about arc_axis, any number of turns
  double feed_mm_s = 0;     ///< of the tip; 0: none, as for rapid moves and in inverse time
  double tolerance_mm = 0;  ///< by which the path may be left at its corners; 0: not at all
};

/// The moves of a program, read without a machine: all six words, and no tool-centre-point control. Tool
/// changes and inputs count as done. `tools`: file of the tool table; "": none. Error.
std::vector<Move> read_gcode(const std::string& file, const std::string& tools = "");
/// The same of a text; errors name it `name`.
std::vector<Move> read_gcode_text(const std::string& text, const std::string& tools = "",
                                  const std::string& name = "text");

/// One motor joint of a machine; mm or rad, and s.
struct Joint {
  std::string name;
  bool rotary = false;
  double min = 0, max = 0;
  double velocity_max = 0, acceleration_max = 0, jerk_max = 0;
};

/// Where the joints shall be at a time.
struct Setpoint {
  double time_s = 0;
  std::vector<double> position;  ///< mm, rad; corrections of the machine's own errors are in it
  std::vector<double> velocity;  ///< mm/s, rad/s
  std::vector<double> acceleration;
  Words words{};           ///< of the path, as the program means them
  std::uint32_t line = 0;  ///< of the program
};

/// Where the tool is: the place of its tip and its direction, from the tip towards the spindle, in the frame
/// of the table.
struct ToolPose {
  std::array<double, 3> tip{}, axis{};
};

/// One ball-bar test: by name one of the machine's own (Machine::ballbar_tests).
struct BallbarTrace {
  std::string test;
  std::vector<double> angle_rad, reading_mm;  ///< of the axis that turns; the bar's change of length
};

/// One error of the machine that a fit has found, or cannot tell.
struct BallbarError {
  std::string name;        ///< as in the config: "C.ex0"
  double value = 0;        ///< mm or rad
  double deviation = 0;    ///< its standard error
  std::string not_fitted;  ///< why the readings cannot tell it; "" if they do
};

struct BallbarFit {
  std::vector<BallbarError> errors;
  double rms_mm = 0;  ///< of what is left of the readings
};

/// A planned motion, setpoint by setpoint. The machine must outlive it.
class Motion {
 public:
  Motion(Motion&&) noexcept;
  Motion& operator=(Motion&&) noexcept;
  ~Motion();
  /// The setpoint of the next period, the first one at time 0 and at rest. False behind the last. Error where
  /// the program is wrong: what was given before it ends at rest.
  bool next(Setpoint& setpoint);

 private:
  friend class Machine;
  struct Parts;
  explicit Motion(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

struct PlanOptions {
  double period_s = 0;             ///< between setpoints, 1e-5 to 0.1; 0: the machine's own period
  std::vector<double> start = {};  ///< joints where the motion begins; none: where the config's drives begin
  std::string tools = {};          ///< file of the tool table; "": none
  std::string variables = {};      ///< file of the program's variables; "": none. It is not written
};

class Machine {
 public:
  /// Error: the config is not right, at file:line:column.
  explicit Machine(const std::string& config_file);
  Machine(Machine&&) noexcept;
  Machine& operator=(Machine&&) noexcept;
  ~Machine();

  std::string name() const;
  double period_s() const;
  std::vector<Joint> joints() const;
  /// Letters of the words that it obeys, as "XYZAC".
  std::string words() const;

  /// The moves of a program as this machine means them: with tool-centre-point control they are those of the
  /// tip in the table's frame. Of `options` tools, variables and start count. Error.
  std::vector<Move> read_gcode(const std::string& file, const PlanOptions& options = {}) const;

  /// Plans a program of a file, or of a text that errors call `name`. It is read to its end first, so that
  /// its errors come at once; a pipe is not. Planning goes on as setpoints are asked for. Tool changes and
  /// inputs count as done.
  Motion plan(const std::string& file, const PlanOptions& options = {}) const;
  Motion plan_text(const std::string& text, const PlanOptions& options = {},
                   const std::string& name = "text") const;

  /// Where the tool is at these joints, without corrections. Error: there is no such pose.
  ToolPose forward(const std::vector<double>& joints, double tool_length_mm = 0) const;
  /// The joints for a pose, the solution nearest to the joints `near` (zeros, if there are none), without
  /// corrections. Limits of position are not judged. Error: the machine cannot take this pose.
  std::vector<double> inverse(const ToolPose& pose, double tool_length_mm = 0,
                              const std::vector<double>& near = {}) const;

  /// Names of the ball-bar tests of a machine with two rotary axes in its table. Error: it is none.
  std::vector<std::string> ballbar_tests() const;
  /// The errors of the rotary axes, and of the set-up, that explain these readings best. `noise_mm`: of one
  /// reading; 0: what is left of them says it. Error: the traces cannot tell an error, or have angles that
  /// are turns away from their test, as degrees are.
  BallbarFit fit_ballbar(const std::vector<BallbarTrace>& traces, double noise_mm = 0) const;

 private:
  struct Parts;
  struct Program;
  Motion planned(const std::string& name, const std::optional<std::string>& text,
                 const PlanOptions& options) const;

  std::unique_ptr<Parts> parts_;
};

}  // namespace trunnion
#pragma GCC visibility pop
