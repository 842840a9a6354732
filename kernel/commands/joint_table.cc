#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <map>
#include <memory>
#include <sstream>

#include "compensation/joint_table_fit.h"
#include "core/machine.h"
#include "core/units.h"
#include "kernel/commands/commands.h"

namespace trn {

namespace {

struct FitOptions {
  std::string measurements, machine, write, plot;
  int table = 0;
};

using Measured = std::map<std::string, std::vector<AxisMeasurement>>;

/// Lines "joint, commanded, actual" in mm or degrees, in the order in which they were taken; a header is
/// skipped.
Measured read_measurements(const std::string& path, const Machine& machine) {
  std::ifstream in(path);
  if (!in) throw std::runtime_error(path + ":1:1: cannot read this file");
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

struct Named {
  std::string joint, unit;
  const std::vector<AxisMeasurement>* measurements;
  JointTableFit fit;
};

std::string config_section(const std::vector<Named>& fits) {
  std::string out = "[corrections.joint_table]\nenabled = true\n";
  for (const Named& n : fits) {
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

/// Error over place: one diagram a joint, points of both directions and what was fitted.
std::string diagram(const Named& n, double top) {
  constexpr double kLeft = 70, kWidth = 540, kHeight = 180;
  double low = 1e300, high = -1e300, peak = 1e-9;
  for (const AxisMeasurement& m : *n.measurements) {
    low = std::min(low, m.commanded);
    high = std::max(high, m.commanded);
    peak = std::max(peak, std::abs(m.actual - m.commanded - n.fit.datum));
  }
  const auto x = [&](double at) { return kLeft + kWidth * (at - low) / std::max(1e-9, high - low); };
  const auto y = [&](double e) { return top + kHeight / 2 + 20 - kHeight / 2 * e / peak; };
  std::string out = fmt::format(
      "<text x='{}' y='{}' font-size='13'>{}: slope {:.3g} +- {:.1g}, backlash {:.4g} {}</text>\n"
      "<line x1='{}' y1='{:.1f}' x2='{}' y2='{:.1f}' stroke='#999'/>\n"
      "<text x='10' y='{:.1f}' font-size='11'>{:.3g} {}</text><text x='10' y='{:.1f}' "
      "font-size='11'>{:.3g}</text>\n",
      kLeft, top + 12, n.joint, n.fit.slope, n.fit.slope_deviation, n.fit.backlash, n.unit, kLeft, y(0),
      kLeft + kWidth, y(0), y(peak) + 8, peak, n.unit, y(-peak), -peak);
  for (std::size_t i = 0; i < n.measurements->size(); ++i) {
    const AxisMeasurement& m = (*n.measurements)[i];
    out +=
        fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='2' fill='{}'/>", x(m.commanded),
                    y(m.actual - m.commanded - n.fit.datum), n.fit.direction[i] > 0 ? "#c0392b" : "#1f6fb2");
  }
  for (const int direction : {1, -1}) {
    std::string points;
    const auto& curve = direction > 0 ? n.fit.forward : n.fit.backward;
    for (std::size_t i = 0; i < n.fit.at.size(); ++i)
      points += fmt::format("{:.1f},{:.1f} ", x(n.fit.at[i]), y(curve[i]));
    if (n.fit.at.empty())
      for (const double at : {low, high})
        points += fmt::format("{:.1f},{:.1f} ", x(at),
                              y((1 / (1 + n.fit.slope) - 1) * at - direction * n.fit.backlash / 2));
    out += fmt::format("\n<polyline points='{}' fill='none' stroke='{}'/>\n", points,
                       direction > 0 ? "#c0392b" : "#1f6fb2");
  }
  return out;
}

std::string picture(const std::vector<Named>& fits) {
  constexpr double kEach = 230;
  const double height = 40 + kEach * static_cast<double>(fits.size());
  std::string out = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 640 {:g}' font-family='sans-serif'>\n"
      "<rect width='640' height='{:g}' fill='white'/>\n"
      "<text x='10' y='20' font-size='14'>Error of the axis, actual less commanded: "
      "<tspan fill='#c0392b'>forward</tspan>, <tspan fill='#1f6fb2'>backward</tspan></text>\n",
      height, height);
  for (std::size_t i = 0; i < fits.size(); ++i) out += diagram(fits[i], 40 + kEach * static_cast<double>(i));
  return out + "</svg>\n";
}

void write_file(const std::string& path, const std::string& text) {
  std::ofstream out(path);
  out << text;
  if (!out.flush()) throw std::runtime_error(path + ": cannot write this file");
}

Exit fit(const FitOptions& options) {
  const Machine machine = read_machine(load_config(options.machine));
  const Measured measured = read_measurements(options.measurements, machine);
  std::vector<Named> fits;
  fmt::print("joint     points  slope          +-          backlash       +-          rms left\n");
  for (const Joint& joint : machine.joints) {
    const auto found = measured.find(joint.name);
    if (found == measured.end()) continue;
    try {
      fits.push_back({joint.name, joint.kind == JointKind::kRotary ? "deg" : "mm", &found->second,
                      fit_joint_table(found->second, options.table)});
    } catch (const std::invalid_argument& bad) {
      throw std::runtime_error(fmt::format("{}: joint {}: {}", options.measurements, joint.name, bad.what()));
    }
    const JointTableFit& f = fits.back().fit;
    fmt::print("{:<9} {:>6}  {:<14.8f} {:<11.2e} {:<14.6f} {:<11.2e} {:.6f} {}\n", joint.name,
               found->second.size(), f.slope, f.slope_deviation, f.backlash, f.backlash_deviation, f.rms,
               fits.back().unit);
  }
  if (!options.plot.empty()) write_file(options.plot, picture(fits));
  if (!options.write.empty())
    write_file(options.write, config_section(fits));
  else
    fmt::print("\n# for the config:\n{}", config_section(fits));
  return Exit::kDone;
}

Exit guarded(const FitOptions& options) {
  try {
    return fit(options);
  } catch (const ConfigError& error) {
    fmt::print(stderr, "{}\n", error.what());
    return Exit::kBadConfig;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return Exit::kBadProgram;
  }
}

}  // namespace

void add_joint_table(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand("joint-table", "Error tables of single joints, from measurements");
  command->require_subcommand(1);
  auto options = std::make_shared<FitOptions>();
  CLI::App* fit_app = command->add_subcommand(
      "fit", "Slope, backlash or table of every measured joint, and the section for the config");
  fit_app
      ->add_option("measurements", options->measurements,
                   "CSV in the order of measuring: joint, commanded, actual (mm or deg), there and back")
      ->required();
  fit_app->add_option("--machine", options->machine, "machine config (.toml)")->required();
  fit_app->add_option("--table", options->table, "a table of this many places instead of a slope")
      ->check(CLI::Range(2, 200));
  fit_app->add_option("--write", options->write, "write the config section to this file");
  fit_app->add_option("--plot", options->plot, "draw errors and fit (SVG)");
  fit_app->callback([options, &exit] { exit = guarded(*options); });
}

}  // namespace trn
