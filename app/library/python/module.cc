// The Python module `trunnion`: the library's functions, with numpy arrays.
#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "app/library/trunnion.h"

namespace py = pybind11;
using namespace py::literals;

namespace {

using Array = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// What a function gives: an object whose attributes have names.
template <typename... Attributes>
py::object result(Attributes&&... attributes) {
  return py::module_::import("types").attr("SimpleNamespace")(std::forward<Attributes>(attributes)...);
}

/// Rows of equal length, filled one behind the other.
class Table {
 public:
  explicit Table(std::size_t columns) : columns_(columns) {}
  template <typename Row>
  void add(const Row& row) {
    values_.insert(values_.end(), row.begin(), row.end());
  }
  Array array() const {
    Array out({values_.size() / columns_, columns_});
    std::copy(values_.begin(), values_.end(), out.mutable_data());
    return out;
  }

 private:
  std::size_t columns_;
  std::vector<double> values_;
};

Array column(const std::vector<double>& values) {
  Array out(values.size());
  std::copy(values.begin(), values.end(), out.mutable_data());
  return out;
}

py::object moves_of(const std::vector<trunnion::Move>& moves) {
  static constexpr const char* kKinds[] = {"rapid", "feed", "arc"};
  Table from(6), to(6), centre(3), axis(3);
  std::vector<double> sweep, feed, tolerance;
  std::vector<std::uint32_t> line;
  py::list kind;
  for (const trunnion::Move& move : moves) {
    from.add(move.from);
    to.add(move.to);
    centre.add(move.arc_centre);
    axis.add(move.arc_axis);
    sweep.push_back(move.arc_sweep_rad);
    feed.push_back(move.feed_mm_s);
    tolerance.push_back(move.tolerance_mm);
    line.push_back(move.line);
    kind.append(kKinds[static_cast<std::size_t>(move.kind)]);
  }
  return result("kind"_a = py::module_::import("numpy").attr("array")(kind),
                "line"_a = py::array(py::cast(line)), "start"_a = from.array(), "end"_a = to.array(),
                "arc_centre"_a = centre.array(), "arc_axis"_a = axis.array(), "arc_sweep"_a = column(sweep),
                "feed"_a = column(feed), "tolerance"_a = column(tolerance));
}

constexpr std::size_t kRowsMax = 20'000'000;  // five hours and a half at 1 ms, 4 GB

/// The rest of a motion, all at once, as long as it has no more rows. Python's other threads go on meanwhile,
/// and Ctrl-C ends it.
py::object setpoints_of(trunnion::Motion motion, std::size_t joints, const std::string& name,
                        std::size_t rows_max) {
  constexpr std::size_t kLookRows = 1 << 14;  // some ten milliseconds
  Table position(joints), velocity(joints), acceleration(joints), words(6);
  std::vector<double> time;
  std::vector<std::uint32_t> line;
  {
    py::gil_scoped_release others;
    for (trunnion::Setpoint setpoint; motion.next(setpoint);) {
      if (time.size() == rows_max)
        throw trunnion::Error(name + ": the motion goes on behind " + std::to_string(rows_max) +
                              " setpoints, which is rows_max; a longer period takes fewer");
      if (time.size() % kLookRows == 0) {
        const py::gil_scoped_acquire python;
        if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      }
      time.push_back(setpoint.time_s);
      position.add(setpoint.position);
      velocity.add(setpoint.velocity);
      acceleration.add(setpoint.acceleration);
      words.add(setpoint.words);
      line.push_back(setpoint.line);
    }
  }
  return result("time"_a = column(time), "position"_a = position.array(), "velocity"_a = velocity.array(),
                "acceleration"_a = acceleration.array(), "words"_a = words.array(),
                "line"_a = py::array(py::cast(line)));
}

/// What somebody gave for `name`, as an array of real numbers: a complex one would lose its imaginary parts.
Array numbers_of(const py::object& given, const char* name) {
  const py::array any = py::array::ensure(given);
  if (!any) throw py::value_error(std::string(name) + ": an array of numbers is needed");
  const std::string kinds = "biufO";
  if (kinds.find(any.dtype().kind()) == std::string::npos)
    throw py::type_error(std::string(name) + ": real numbers are needed, not " +
                         std::string(py::str(any.dtype())));
  Array numbers = Array::ensure(any);
  if (!numbers) throw py::type_error(std::string(name) + ": real numbers are needed");
  return numbers;
}

/// The numbers of an array of one row.
std::vector<double> row_of(const py::object& given, const char* name) {
  const Array numbers = numbers_of(given, name);
  if (numbers.ndim() != 1) throw py::value_error(std::string(name) + ": one row of numbers is needed");
  return {numbers.data(), numbers.data() + numbers.size()};
}

/// The rows of an array of shape (columns) or (n, columns).
std::vector<std::vector<double>> rows_of(const Array& array, std::size_t columns, const char* name) {
  const bool one = array.ndim() == 1;
  if ((!one && array.ndim() != 2) || static_cast<std::size_t>(array.shape(one ? 0 : 1)) != columns)
    throw py::value_error(std::string(name) + ": an array of " + std::to_string(columns) +
                          " columns is needed, or one row of it");
  std::vector<std::vector<double>> rows(one ? 1 : static_cast<std::size_t>(array.shape(0)));
  const double* next = array.data();
  for (auto& row : rows) {
    row.assign(next, next + columns);
    next += columns;
  }
  return rows;
}

trunnion::PlanOptions options_of(double period, const py::object& start, std::string tools,
                                 std::string variables) {
  return {period, row_of(start, "start"), std::move(tools), std::move(variables)};
}

py::object shaped(const Array& table, bool one_row) {
  return one_row ? py::object(table[py::int_(0)]) : py::object(table);
}

py::tuple forward(const trunnion::Machine& machine, const py::object& given, double tool_length) {
  const Array joints = numbers_of(given, "joints");
  Table tips(3), axes(3);
  for (const auto& row : rows_of(joints, machine.joints().size(), "joints")) {
    const trunnion::ToolPose pose = machine.forward(row, tool_length);
    tips.add(pose.tip);
    axes.add(pose.axis);
  }
  const bool one = joints.ndim() == 1;
  return py::make_tuple(shaped(tips.array(), one), shaped(axes.array(), one));
}

py::object inverse(const trunnion::Machine& machine, const py::object& given_tip,
                   const py::object& given_axis, double tool_length, const py::object& given_near) {
  const Array tip = numbers_of(given_tip, "tip"), axis = numbers_of(given_axis, "axis");
  const auto tips = rows_of(tip, 3, "tip"), axes = rows_of(axis, 3, "axis");
  std::vector<double> near = row_of(given_near, "near");
  if (tips.size() != axes.size()) throw py::value_error("as many tips as axes are needed");
  Table joints(machine.joints().size());
  for (std::size_t i = 0; i < tips.size(); ++i) {
    trunnion::ToolPose pose;
    std::copy_n(tips[i].begin(), 3, pose.tip.begin());
    std::copy_n(axes[i].begin(), 3, pose.axis.begin());
    near = machine.inverse(pose, tool_length, near);
    joints.add(near);
  }
  return shaped(joints.array(), tip.ndim() == 1);
}

py::object fit_ballbar(const trunnion::Machine& machine,
                       const std::map<std::string, std::pair<py::object, py::object>>& traces, double noise) {
  std::vector<trunnion::BallbarTrace> given;
  for (const auto& [test, columns] : traces) {
    const std::string angles = "the angles of test '" + test + "'";
    const std::string readings = "the readings of test '" + test + "'";
    given.push_back({test, row_of(columns.first, angles.c_str()), row_of(columns.second, readings.c_str())});
  }
  const trunnion::BallbarFit fit = machine.fit_ballbar(given, noise);
  py::dict errors, not_fitted;
  for (const trunnion::BallbarError& error : fit.errors) {
    if (error.not_fitted.empty())
      errors[py::str(error.name)] = py::make_tuple(error.value, error.deviation);
    else
      not_fitted[py::str(error.name)] = error.not_fitted;
  }
  return result("errors"_a = errors, "not_fitted"_a = not_fitted, "rms"_a = fit.rms_mm);
}

void add_joint(py::module_& module) {
  py::class_<trunnion::Joint>(module, "Joint", "One motor joint: its name, range and limits.")
      .def_readonly("name", &trunnion::Joint::name)
      .def_readonly("rotary", &trunnion::Joint::rotary)
      .def_readonly("min", &trunnion::Joint::min)
      .def_readonly("max", &trunnion::Joint::max)
      .def_readonly("velocity_max", &trunnion::Joint::velocity_max)
      .def_readonly("acceleration_max", &trunnion::Joint::acceleration_max)
      .def_readonly("jerk_max", &trunnion::Joint::jerk_max)
      .def("__repr__", [](const trunnion::Joint& joint) {
        return py::str("Joint({}, {:g} to {:g} {})")
            .format(joint.name, joint.min, joint.max, joint.rotary ? "rad" : "mm");
      });
}

void add_machine(py::module_& module) {
  py::class_<trunnion::Machine>(module, "Machine", "A machine, as its config describes it.")
      .def(py::init<const std::string&>(), "config"_a)
      .def_property_readonly("name", &trunnion::Machine::name)
      .def_property_readonly("period", &trunnion::Machine::period_s, "s")
      .def_property_readonly("joints", &trunnion::Machine::joints)
      .def_property_readonly("words", &trunnion::Machine::words, "letters of the words that it obeys")
      .def(
          "read_gcode",
          [](const trunnion::Machine& machine, const std::string& file, const std::string& tools,
             const std::string& variables) {
            return moves_of(machine.read_gcode(file, options_of(0, py::tuple(), tools, variables)));
          },
          "file"_a, py::kw_only(), "tools"_a = "", "variables"_a = "",
          "As the module's function, with the tip's moves in the table frame where the program asks for "
          "that.")
      .def(
          "plan",
          [](const trunnion::Machine& machine, const std::string& file, double period,
             const py::object& start, const std::string& tools, const std::string& variables,
             std::size_t rows_max) {
            return setpoints_of(machine.plan(file, options_of(period, start, tools, variables)),
                                machine.joints().size(), file, rows_max);
          },
          "file"_a, py::kw_only(), "period"_a = 0, "start"_a = py::tuple(), "tools"_a = "",
          "variables"_a = "", "rows_max"_a = kRowsMax,
          "The setpoints of a program: time (n), position, velocity, acceleration (n, joints), words (n, 6), "
          "line.\n"
          "period: s between them, 1e-5 to 0.1, 0 for the machine's own; start: the joints where the motion "
          "begins; rows_max: a longer motion is an error, as a row takes some 200 bytes. Ctrl-C ends it.")
      .def(
          "plan_text",
          [](const trunnion::Machine& machine, const std::string& text, double period,
             const py::object& start, const std::string& tools, const std::string& variables,
             const std::string& name, std::size_t rows_max) {
            return setpoints_of(machine.plan_text(text, options_of(period, start, tools, variables), name),
                                machine.joints().size(), name, rows_max);
          },
          "text"_a, py::kw_only(), "period"_a = 0, "start"_a = py::tuple(), "tools"_a = "",
          "variables"_a = "", "name"_a = "text", "rows_max"_a = kRowsMax, "The same of a text.")
      .def("forward", &forward, "joints"_a, "tool_length"_a = 0.0,
           "Tip and tool axis (from the tip towards the spindle) in the table frame, (n, 3) each.")
      .def("inverse", &inverse, "tip"_a, "axis"_a, "tool_length"_a = 0.0, "near"_a = py::tuple(),
           "The joints (n, joints) for tips and axes; each solution is the nearest to the one before.")
      .def("__repr__",
           [](const trunnion::Machine& machine) {
             return py::str("Machine({}, joints {})").format(machine.name(), machine.joints());
           })
      .def_property_readonly("ballbar_tests", &trunnion::Machine::ballbar_tests)
      .def("fit_ballbar", &fit_ballbar, "traces"_a, "noise"_a = 0.0,
           "traces: {test: (angles in rad, readings in mm)}. errors: {name: (value, standard error)}; "
           "not_fitted: {name: "
           "why};\n"
           "rms of what is left, mm.");
}

}  // namespace

PYBIND11_MODULE(trunnion, module) {
  module.doc() =
      "Reads G-code, plans motions inside the limits of a machine's joints, and knows its kinematics.\n"
      "Lengths are mm, angles rad, times s; arrays have a row for each place.";
  py::register_exception<trunnion::Error>(module, "Error", PyExc_ValueError);
  module.def(
      "read_gcode",
      [](const std::string& file, const std::string& tools) {
        return moves_of(trunnion::read_gcode(file, tools));
      },
      "file"_a, "tools"_a = "",
      "The moves of a program, without a machine: kind, line, start and end (n, 6), arc_centre, arc_axis,\n"
      "arc_sweep, feed, tolerance.");
  module.def(
      "read_gcode_text",
      [](const std::string& text, const std::string& tools, const std::string& name) {
        return moves_of(trunnion::read_gcode_text(text, tools, name));
      },
      "text"_a, "tools"_a = "", "name"_a = "text", "The same of a text; errors call it `name`.");
  add_joint(module);
  add_machine(module);
}
