#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <memory>
#include <optional>
#include <sstream>
#include <tuple>
#include <utility>

#include "app/cli/commands.h"
#include "app/cli/named_files.h"
#include "app/lab/error_curves.h"
#include "app/lab/joint_measure.h"
#include "app/lab/text_file.h"
#include "app/session/assembly.h"
#include "compensation/fit/joint_table_fit.h"
#include "compensation/joint_tables.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/machine.h"
#include "core/plain_file.h"
#include "core/units.h"

namespace trn {

namespace {

struct TableFitOptions {
  std::string measurements, machine, write, plot;
  int table = 0;
};

struct MeasureOptions {
  std::string machine, truth, word = "X", out = "joint-table";
  std::optional<double> from, to;
  int places = 25, passes = 2;
  double noise_um = 0, resolution_um = 0;
  unsigned seed = 1;
};

using Measured = std::map<std::string, std::vector<AxisMeasurement>>;

/// Lines "joint, commanded, actual" in mm or degrees, in the order in which they were taken; a header is
/// skipped.
Measured read_measurements(const std::string& path, const Machine& machine) {
  std::istringstream in(read_named_file(path));
  Measured out;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    if (line.empty() || line[0] == '#' || line == "\r") continue;
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream fields(line);
    std::string name, rest;
    AxisMeasurement m;
    if (!(fields >> name >> m.commanded >> m.actual) || (fields >> rest)) {
      if (number == 1) continue;
      throw std::runtime_error(
          fmt::format("{}:{}:1: expected joint, commanded, actual (mm or deg)", path, number));
    }
    const auto joint = std::find_if(machine.joints.begin(), machine.joints.end(),
                                    [&](const Joint& j) { return j.name == name; });
    if (joint == machine.joints.end()) {
      std::vector<std::string> names;
      for (const Joint& j : machine.joints) names.push_back(j.name);
      throw std::runtime_error(fmt::format("{}:{}:1: no joint '{}'; the machine has {}", path, number, name,
                                           fmt::join(names, ", ")));
    }
    out[name].push_back(m);
  }
  if (out.empty()) throw std::runtime_error(path + ":1:1: no measurements in this file");
  return out;
}

double half_gap(const ErrorCurve& n) {
  double most = n.fit.backlash / 2;
  for (std::size_t i = 0; i < n.fit.at.size(); ++i)
    most = std::max(most, std::abs(n.fit.backward[i] - n.fit.forward[i]) / 2);
  return most;
}

// What a gap needs on reversal, where that is more than the default; the section would be refused otherwise.
std::string limits_of(const std::vector<ErrorCurve>& fits) {
  constexpr std::pair<const char*, double> kDefaults[] = {{"mm", 0.1}, {"deg", 0.01}};
  constexpr double kRoom = 1.2;
  std::string out;
  for (const auto& [unit, most_by_default] : kDefaults) {
    double most = 0;
    for (const ErrorCurve& n : fits)
      if (n.unit == unit) most = std::max(most, half_gap(n));
    if (most > most_by_default) out += fmt::format("limit_{} = {:.3g}\n", unit, kRoom * most);
  }
  return out;
}

std::string config_section(const std::vector<ErrorCurve>& fits) {
  std::string out = "[corrections.joint_table]\nenabled = true\n" + limits_of(fits);
  for (const ErrorCurve& n : fits) {
    out += fmt::format("\n[[corrections.joint_table.joint]]\njoint = \"{}\"\n", n.joint);
    if (n.fit.at.empty()) {
      out += fmt::format("slope = {:.9g}\n", n.fit.slope);
      if (n.fit.backlash > 0) out += fmt::format("backlash_{} = {:.9g}\n", n.unit, n.fit.backlash);
      continue;
    }
    const auto list = [&](const char* key, const std::vector<double>& values) {
      return fmt::format("{}_{} = [{:.7g}]\n", key, n.unit, fmt::join(values, ", "));
    };
    out += list("at", n.fit.at) + list("forward", n.fit.forward) + list("backward", n.fit.backward);
  }
  return out;
}

std::string unit_of(const Joint& joint) { return joint.kind == JointKind::kRotary ? "deg" : "mm"; }

/// The fit of every measured joint, and the table of them.
std::vector<ErrorCurve> fit_all(const Machine& machine, const Measured& measured, int places,
                                const std::string& file) {
  std::vector<ErrorCurve> fits;
  fmt::print("joint     points  slope          +-          backlash       +-          rms left\n");
  for (const Joint& joint : machine.joints) {
    const auto found = measured.find(joint.name);
    if (found == measured.end()) continue;
    try {
      fits.push_back({joint.name, unit_of(joint), &found->second, fit_joint_table(found->second, places)});
    } catch (const std::invalid_argument& bad) {
      throw std::runtime_error(fmt::format("{}: joint {}: {}", file, joint.name, bad.what()));
    }
    const JointTableFit& f = fits.back().fit;
    fmt::print("{:<9} {:>6}  {:<14.8f} {:<11.2e} {:<14.6f} {:<11.2e} {:.6f} {}\n", joint.name,
               found->second.size(), f.slope, f.slope_deviation, f.backlash, f.backlash_deviation, f.rms,
               fits.back().unit);
  }
  return fits;
}

Exit fit_tables(const TableFitOptions& options) {
  const Machine machine = read_machine(load_config(options.machine));
  const Measured measured = read_measurements(options.measurements, machine);
  const std::vector<ErrorCurve> fits = fit_all(machine, measured, options.table, options.measurements);
  if (!options.plot.empty()) write_text_file(options.plot, error_curves(fits));
  if (!options.write.empty())
    write_text_file(options.write, config_section(fits));
  else
    fmt::print("\n# for the config:\n{}", config_section(fits));
  return Exit::kDone;
}

int word_named(const Assembly& assembly, const std::string& name) {
  std::string legal;
  for (int word = kX; word <= kC; ++word) {
    if ((assembly.kinematics->word_mask() >> word & 1u) == 0) continue;
    if (name.size() == 1 && name[0] == kWordLetters[word]) return word;
    legal += fmt::format(" {}", kWordLetters[word]);
  }
  throw CLI::ValidationError("--word", fmt::format("no word '{}'; the machine has{}", name, legal));
}

/// In mm and degrees, by joint name.
Measured by_name(const Machine& machine, const JointMeasurements& measurements) {
  Measured out;
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    const double unit = machine.joints[i].kind == JointKind::kRotary ? kDegPerRad : 1;
    for (const AxisMeasurement& m : measurements[i])
      out[machine.joints[i].name].push_back({unit * m.commanded, unit * m.actual});
  }
  return out;
}

void write_measurements(const std::string& path, const Measured& measured) {
  std::string text = "joint,commanded,actual\n";
  for (const auto& [joint, points] : measured)
    for (const AxisMeasurement& m : points)
      text += fmt::format("{},{:.9f},{:.9f}\n", joint, m.commanded, m.actual);
  write_text_file(path, text);
}

std::vector<JointTable> read_true_tables(const Machine& machine, const std::string& path) {
  const ConfigTable root = load_config(path);
  return read_joint_tables(machine, root.table("corrections").table("joint_table"));
}

Exit measure(const MeasureOptions& options) {
  Assembly plain = assemble(options.machine), corrected = assemble(options.machine);
  const Machine& machine = plain.machine;
  const std::vector<JointTable> truth = read_true_tables(machine, options.truth);
  JointMeasureConfig config;
  config.word = word_named(plain, options.word);
  const double unit = config.word < kA ? 1 : kRadPerDeg;
  std::tie(config.from, config.to) = word_range(plain, config.word);
  if (options.from) config.from = unit * *options.from;
  if (options.to) config.to = unit * *options.to;
  if (!(config.to > config.from))
    throw CLI::ValidationError("--from", "the way must rise from --from to --to");
  config.places = options.places;
  config.passes = options.passes;
  config.noise = options.noise_um / 1000;
  config.resolution = options.resolution_um / 1000;
  config.seed = options.seed;
  make_result_folder(options.out);
  const std::string program = options.out + "/measure.ngc";
  const Measured before = by_name(machine, measure_joints(plain, truth, config, false, program));
  write_measurements(options.out + "/before.csv", before);
  std::vector<ErrorCurve> fits = fit_all(machine, before, 0, program);
  Measured after;
  if (corrected.map->has_joint()) {
    config.seed += 1000;
    after = by_name(machine, measure_joints(corrected, truth, config, true, program));
    write_measurements(options.out + "/after.csv", after);
    fmt::print("\njoint     error without    with correction\n");
    for (ErrorCurve& curve : fits) {
      curve.after = &after[curve.joint];
      fmt::print("{:<9} {:<16.6f} {:.6f} {}\n", curve.joint, error_amplitude(*curve.measured),
                 error_amplitude(*curve.after), curve.unit);
    }
  }
  write_text_file(options.out + "/curves.svg", error_curves(fits));
  fmt::print("program, measurements (CSV) and picture (SVG) are in {}/\n", options.out);
  return Exit::kDone;
}

// What is thrown here without a kind of its own is about the measurements.
template <typename Options>
Exit guarded(Exit (*work)(const Options&), const Options& options) {
  try {
    return work(options);
  } catch (const std::exception&) {
    return tell_exception(Exit::kBadProgram);
  }
}

void add_measure(CLI::App& parent, Exit& exit) {
  auto options = std::make_shared<MeasureOptions>();
  CLI::App* app = parent.add_subcommand(
      "measure",
      "Rehearse a measurement there and back, on a simulated machine whose joints have errors. It is made "
      "without correction and, where the config has joint tables, with it; writes CSV and a picture");
  app->add_option("--machine,-m", options->machine, kMachineOption)->required();
  app->add_option("--truth", options->truth,
                  "the simulated machine's true errors: a file with a section [corrections.joint_table]")
      ->required();
  app->add_option("--word", options->word,
                  "axis word that is driven; every joint that moves with it is measured")
      ->capture_default_str();
  app->add_option("--from", options->from, "mm or deg; default: as far as the machine goes");
  app->add_option("--to", options->to, "mm or deg");
  app->add_option("--places", options->places, "where it stops on the way")
      ->check(CLI::Range(3, 1000))
      ->capture_default_str();
  app->add_option("--passes", options->passes, "there and back")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  app->add_option("--noise-um", options->noise_um, "standard deviation of a reading")
      ->check(CLI::NonNegativeNumber);
  app->add_option("--resolution-um", options->resolution_um, "of the scales")->check(CLI::NonNegativeNumber);
  app->add_option("--seed", options->seed, "of the noise");
  app->add_option("--out", options->out, "folder for program, measurements and picture")
      ->capture_default_str();
  app->callback([options, &exit] { exit = guarded(&measure, *options); });
}

}  // namespace

void add_joint_table(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand(
      "joint-table", "Find the errors of single joints, as a screw's or a scale's, from measurements");
  command->require_subcommand(1);
  auto options = std::make_shared<TableFitOptions>();
  CLI::App* fit_app = command->add_subcommand(
      "fit", "Find slope, backlash or table of every measured joint, and write the section for the config");
  fit_app
      ->add_option("measurements", options->measurements,
                   "CSV in the order of measuring: joint, commanded, actual (mm or deg), there and back")
      ->required();
  fit_app->add_option("--machine,-m", options->machine, kMachineOption)->required();
  fit_app->add_option("--table", options->table, "a table of this many places instead of a slope")
      ->check(CLI::Range(2, 200));
  fit_app->add_option("--write", options->write, "write the config section to this file");
  fit_app->add_option("--plot", options->plot, "draw errors and fit (SVG)");
  fit_app->callback([options, &exit] { exit = guarded(&fit_tables, *options); });
  add_measure(*command, exit);
}

}  // namespace trn
