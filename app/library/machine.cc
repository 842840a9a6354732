#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "app/lab/ball_contacts.h"
#include "app/library/as_error.h"
#include "app/library/move_list.h"
#include "app/library/setpoint_stream.h"
#include "app/library/trunnion.h"
#include "app/session/assembly.h"
#include "app/session/pipeline.h"
#include "compensation/actual_chain.h"
#include "compensation/fit/ballbar.h"
#include "compensation/fit/ballbar_fit.h"
#include "compensation/rtcp.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/ports.h"
#include "core/units.h"
#include "interp/gcode/parameter_file.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/tool_table.h"
#include "kernel/joint_map.h"

namespace trunnion {

using trn::as_error;

namespace {

// As in a config: nothing has a length or an angle beyond it.
constexpr double kLargest = 1e15;

void check_number(double value, const std::string& name) {
  if (!std::isfinite(value)) throw Error(fmt::format("{} is not a finite number", name));
  if (std::abs(value) > kLargest)
    throw Error(
        fmt::format("{} = {:g} is too large to be meant: up to {:g} is legal", name, value, kLargest));
}

void check_vector(const std::array<double, 3>& vector, const char* name) {
  for (std::size_t i = 0; i < vector.size(); ++i)
    check_number(vector[i], fmt::format("{}: the component {}", name, "xyz"[i]));
}

}  // namespace

struct Machine::Parts {
  explicit Parts(const std::string& config) : assembly(trn::assemble(config)) {}
  trn::Assembly assembly;

  /// `name`: of the argument, for errors.
  trn::JointVec joints(const std::vector<double>& values, const char* name) const {
    const std::size_t count = assembly.machine.joints.size();
    if (values.empty()) return trn::JointVec::Zero(static_cast<Eigen::Index>(count));
    if (values.size() != count)
      throw Error(fmt::format("{}: {} joints were given; the machine '{}' has {}", name, values.size(),
                              assembly.machine.name, count));
    for (std::size_t i = 0; i < count; ++i)
      check_number(values[i],
                   fmt::format("{}: the place of joint {}", name, assembly.machine.joints[i].name));
    return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(count));
  }
};

/// A program with its files, before it is read.
struct Machine::Program {
  trn::Parameters parameters;
  trn::ToolTable tools;
  trn::ProgramStart start;

  Program(const Parts& parts, const std::string& name, const std::optional<std::string>& text,
          const PlanOptions& options)
      : start{name, text,
              options.start.empty() ? trn::standing_joints(parts.assembly)
                                    : parts.joints(options.start, "start")} {
    if (!options.variables.empty()) trn::load_parameters(options.variables, parameters);
    if (!options.tools.empty())
      tools = trn::ToolTable::load(options.tools, parts.assembly.program.parameter_unit_mm);
    start.switches = trn::ProgramSwitches::of(parts.assembly);
    start.ends_round = true;
  }
};

struct Motion::Parts {
  trn::SetpointStream stream;
};

namespace {

void refuse(trn::KinStatus status) {
  if (status != trn::KinStatus::kOk) throw Error("no such pose: " + std::string(trn::to_string(status)));
}

// A program may be planned with a period of its own; the plan itself does not depend on it. Its range is that
// of machine.period_s: with a shorter one the setpoints of a second would fill the memory.
double period_of(const PlanOptions& options, const trn::Assembly& assembly) {
  constexpr double kShortest_s = 1e-5, kLongest_s = 0.1;
  if (options.period_s == 0) return assembly.machine.period_s;
  if (!(options.period_s >= kShortest_s && options.period_s <= kLongest_s))
    throw Error(
        fmt::format("period_s = {:g} is out of range: {:g} to {:g} is legal, or 0 for the machine's own",
                    options.period_s, kShortest_s, kLongest_s));
  return options.period_s;
}

trn::Vec3 vec3(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

trn::BallbarTrace trace_of(const BallbarTrace& given, const std::vector<trn::BallbarTest>& tests) {
  const auto test =
      std::find_if(tests.begin(), tests.end(), [&](const auto& t) { return t.name == given.test; });
  if (test == tests.end())
    throw Error("no ball-bar test '" + given.test + "'; Machine::ballbar_tests names them");
  if (given.angle_rad.size() != given.reading_mm.size())
    throw Error("test '" + given.test + "': as many angles as readings are needed");
  // No axis is turned so far beyond its test; in degrees a test's own range is.
  constexpr double kBeyond_rad = 4 * 2 * trn::kPi;
  for (const double angle : given.angle_rad)
    if (angle < test->from_rad - kBeyond_rad || angle > test->to_rad + kBeyond_rad)
      throw Error(
          fmt::format("test '{}': an angle is {:g} rad, but the test goes from {:.3g} to {:.3g} rad; are "
                      "these degrees?",
                      given.test, angle, test->from_rad, test->to_rad));
  trn::BallbarTrace trace{*test, {}};
  for (std::size_t i = 0; i < given.angle_rad.size(); ++i)
    trace.readings.push_back({given.angle_rad[i], given.reading_mm[i]});
  return trace;
}

}  // namespace

Motion::Motion(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Motion::Motion(Motion&&) noexcept = default;
Motion& Motion::operator=(Motion&&) noexcept = default;
Motion::~Motion() = default;

bool Motion::next(Setpoint& setpoint) {
  return as_error([&] { return parts_->stream.next(setpoint); });
}

Machine::Machine(const std::string& config_file)
    : parts_(as_error([&] { return std::make_unique<Parts>(config_file); })) {}
Machine::Machine(Machine&&) noexcept = default;
Machine& Machine::operator=(Machine&&) noexcept = default;
Machine::~Machine() = default;

std::string Machine::name() const { return parts_->assembly.machine.name; }
double Machine::period_s() const { return parts_->assembly.machine.period_s; }

std::vector<Joint> Machine::joints() const {
  std::vector<Joint> out;
  for (const trn::Joint& joint : parts_->assembly.machine.joints)
    out.push_back({joint.name, joint.kind == trn::JointKind::kRotary, joint.limit.min, joint.limit.max,
                   joint.limit.velocity, joint.limit.acceleration, joint.limit.jerk});
  return out;
}

std::string Machine::words() const {
  std::string out;
  for (int k = 0; k < 6; ++k)
    if (parts_->assembly.kinematics->word_mask() >> k & 1) out += trn::kWordLetters[k];
  return out;
}

std::vector<Move> Machine::read_gcode(const std::string& file, const PlanOptions& options) const {
  return as_error([&] {
    Program program(*parts_, file, std::nullopt, options);
    trn::MoveList list;
    trn::ProgramReader reader(parts_->assembly, program.parameters, program.tools, program.start, list);
    while (reader.step())
      if (reader.interpreter().loops_long()) throw Error(file + ": the program goes round, perhaps for ever");
    return std::move(list.moves);
  });
}

Motion Machine::plan(const std::string& file, const PlanOptions& options) const {
  return planned(file, std::nullopt, options);
}

Motion Machine::plan_text(const std::string& text, const PlanOptions& options,
                          const std::string& name) const {
  return planned(name, text, options);
}

Motion Machine::planned(const std::string& name, const std::optional<std::string>& text,
                        const PlanOptions& options) const {
  return as_error([&] {
    const trn::Assembly& assembly = parts_->assembly;
    const double period_s = period_of(options, assembly);
    Program program(*parts_, name, text, options);
    // As `trunnion run` does: what the machine cannot reach is told with its place, before anything is
    // planned. A pipe can be read only once.
    if (text || std::filesystem::is_regular_file(name))
      trn::check_program(assembly, program.parameters, program.tools, program.start, {}, nullptr);
    return Motion(std::unique_ptr<Motion::Parts>(new Motion::Parts{
        {assembly, program.start, std::move(program.parameters), std::move(program.tools), period_s}}));
  });
}

ToolPose Machine::forward(const std::vector<double>& joints, double tool_length_mm) const {
  return as_error([&] {
    check_number(tool_length_mm, "tool_length_mm");
    trn::MapContext context;
    context.tool_offset = {0, 0, tool_length_mm};
    trn::ToolPose found;
    refuse(trn::tool_pose(*parts_->assembly.kinematics, parts_->joints(joints, "joints"), context, found));
    ToolPose out;
    std::copy_n(found.p_B.data(), 3, out.tip.begin());
    std::copy_n(found.u_B.data(), 3, out.axis.begin());
    return out;
  });
}

// The words that point the tool there are found first: their joints are what the solution shall be near.
std::vector<double> Machine::inverse(const ToolPose& pose, double tool_length_mm,
                                     const std::vector<double>& near) const {
  return as_error([&] {
    check_vector(pose.tip, "tip");
    check_vector(pose.axis, "axis");
    check_number(tool_length_mm, "tool_length_mm");
    if (vec3(pose.axis).norm() == 0) throw Error("axis: the tool's axis is the zero vector");
    const trn::Kinematics& kinematics = *parts_->assembly.kinematics;
    trn::Words words = trn::Words::Zero();
    if (!near.empty()) refuse(kinematics.words_from_joints(parts_->joints(near, "near"), words));
    trn::Vec3 abc = trn::Vec3::Zero();
    refuse(kinematics.words_for_axis(vec3(pose.axis).normalized(), words.tail<3>(), abc));
    words << vec3(pose.tip), abc;
    trn::JointVec seed, q;
    kinematics.joints_from_words(words, seed);
    const trn::Pose X_BS =
        trn::spindle_from_tip(words.head<3>(), kinematics.orientation(abc), {0, 0, tool_length_mm});
    refuse(kinematics.inverse(X_BS, seed, q));
    return std::vector<double>(q.data(), q.data() + q.size());
  });
}

std::vector<std::string> Machine::ballbar_tests() const {
  return as_error([&] {
    std::vector<std::string> names;
    for (const trn::BallbarTest& test : trn::ballbar_tests(trn::known_chain(parts_->assembly.machine)))
      names.push_back(test.name);
    return names;
  });
}

BallbarFit Machine::fit_ballbar(const std::vector<BallbarTrace>& traces, double noise_mm) const {
  return as_error([&] {
    const trn::ActualChain chain = trn::known_chain(parts_->assembly.machine);
    const std::vector<trn::BallbarTest> tests = trn::ballbar_tests(chain);
    std::vector<trn::BallbarTrace> read;
    for (const BallbarTrace& trace : traces) read.push_back(trace_of(trace, tests));
    if (!(std::isfinite(noise_mm) && noise_mm >= 0))
      throw Error(fmt::format("noise_mm = {:g} is out of range: 0 or more is legal", noise_mm));
    trn::BallbarFitOptions options;
    if (noise_mm > 0) options.noise_mm = noise_mm;
    const trn::BallbarFit fit = trn::fit_ballbar(chain, read, options);
    BallbarFit out;
    out.rms_mm = fit.rms_mm;
    for (const trn::BallbarParameter& p : fit.parameters)
      out.errors.push_back({p.name, p.value, p.deviation, p.unknown});
    return out;
  });
}

}  // namespace trunnion
