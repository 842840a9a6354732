#include "compensation/fit/ballbar.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "app/cli/commands.h"
#include "app/cli/named_files.h"
#include "app/lab/ball_contacts.h"
#include "app/lab/ballbar_run.h"
#include "app/lab/polar_plot.h"
#include "app/lab/text_file.h"
#include "app/session/assembly.h"
#include "compensation/actual_chain.h"
#include "compensation/fit/ballbar_fit.h"
#include "compensation/geometric.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/units.h"

namespace trn {

namespace {

struct RunOptions {
  std::string machine, truth, out = "ballbar";
  std::vector<std::string> tests{"a", "a_extended", "c", "c_extended"};
  double noise_um = 0, resolution_um = 0;
  unsigned seed = 1;
  std::vector<double> ball_offset_mm{0, 0, 0}, cup_offset_mm{0, 0, 0};
  bool every_period = false;
};

struct IdentifyOptions {
  std::string machine, write;
  std::vector<std::string> traces;
  bool planar = false, no_setup = false, json = false;
  double noise_um = 0;
};

ActualChain read_truth(const Machine& machine, const std::string& path) {
  const ConfigTable root = load_config(path);
  const GeometricConfig config = read_geometric(machine, root.table("corrections").table("geometric"));
  return config.chain;
}

Assembly without_geometry(const std::string& path) {
  Assembly assembly = assemble(path);
  assembly.corrections.planned_off |= kGeometricBit;
  return assembly;
}

BallbarInstrument instrument_of(const RunOptions& options) {
  BallbarInstrument instrument;
  instrument.noise_mm = options.noise_um / 1000;
  instrument.resolution_mm = options.resolution_um / 1000;
  instrument.seed = options.seed;
  instrument.every_period = options.every_period;
  instrument.setup.ball_offset_B = Vec3(options.ball_offset_mm.data());
  instrument.setup.cup_offset_M = Vec3(options.cup_offset_mm.data());
  return instrument;
}

const BallbarTest& test_named(const std::vector<BallbarTest>& tests, const std::string& name) {
  for (const BallbarTest& test : tests)
    if (test.name == name) return test;
  std::vector<std::string> names;
  for (const BallbarTest& test : tests) names.push_back(test.name);
  throw CLI::ValidationError("--tests",
                             fmt::format("no test '{}'; there are {}", name, fmt::join(names, ", ")));
}

/// One test without and, where the config corrects anything, with compensation; files and a line of report.
void run_test(const RunOptions& options, const ActualChain& truth, const BallbarTest& test, unsigned number) {
  const std::string stem = options.out + "/" + test.name;
  BallbarInstrument instrument = instrument_of(options);
  instrument.seed += 1000 * number;
  if (isatty(STDERR_FILENO)) fmt::print(stderr, "\rtest {} ... \033[K", test.name);
  Assembly plain = without_geometry(options.machine);
  const BallbarTrace off = run_ballbar(plain, truth, test, instrument, stem + ".ngc");
  write_ballbar_csv(stem + "_off.csv", off, false);
  std::vector<PolarCurve> curves{{&off, "without compensation"}};
  Assembly corrected = assemble(options.machine);
  BallbarTrace on;
  if (corrected.corrections.pose) {
    instrument.seed += 500;
    on = run_ballbar(corrected, truth, test, instrument, stem + ".ngc");
    write_ballbar_csv(stem + "_on.csv", on, true);
    curves.push_back({&on, "with compensation"});
  }
  write_text_file(stem + ".svg",
                  polar_plot(fmt::format("Ball bar, test {} (bar {:g} mm)", test.name, test.bar_mm), curves));
  if (isatty(STDERR_FILENO)) fmt::print(stderr, "\r\033[K");
  const std::string after = on.readings.empty() ? "-" : fmt::format("{:.6f}", 1000 * on.peak_to_peak_mm());
  fmt::print("{:<12} {:>8} {:>14.4f} {:>14}\n", test.name, off.readings.size(), 1000 * off.peak_to_peak_mm(),
             after);
  std::fflush(stdout);
}

Exit run(const RunOptions& options) {
  const Machine machine = assemble(options.machine).machine;
  const ActualChain truth = options.truth.empty() ? known_chain(machine) : read_truth(machine, options.truth);
  const std::vector<BallbarTest> tests = ballbar_tests(truth);
  for (const std::string& name : options.tests) test_named(tests, name);
  make_result_folder(options.out);
  fmt::print("test         readings  deviation um    compensated um\n");
  unsigned number = 0;
  for (const std::string& name : options.tests) run_test(options, truth, test_named(tests, name), number++);
  fmt::print("programs, traces (CSV) and pictures (SVG) are in {}/\n", options.out);
  return Exit::kDone;
}

/// One axis error alone: 10 um or 0.01 degree.
struct SingleError {
  std::string name;
  int joint;
  bool tilt;
  int component;
};

std::vector<SingleError> single_errors(const ActualChain& chain) {
  std::vector<SingleError> out;
  for (const ActualAxis& axis : chain.work)
    for (int k = 0; k < 6 && axis.joint >= 0; ++k)
      if (std::abs(axis.direction[k % 3]) < 0.5)
        out.push_back({fmt::format("{}: e{}0", axis.direction.x() != 0 ? "A" : "C", "xyzabc"[k]), axis.joint,
                       k > 2, k % 3});
  return out;
}

BallbarTrace pattern(ActualChain chain, const BallbarTest& test, const SingleError& error) {
  SixErrors& location = find_axis(chain, error.joint)->location;
  (error.tilt ? location.tilt : location.offset)[error.component] = error.tilt ? 0.01 * kRadPerDeg : 0.01;
  BallbarTrace trace{test, {}};
  for (double a = test.from_rad; a < test.to_rad + 1e-9; a += test.step_rad)
    trace.readings.push_back({a, ballbar_reading(chain, test, {}, ballbar_joints(chain, test, a))});
  return trace;
}

Exit patterns(const RunOptions& options) {
  const ActualChain nominal = read_chain(assemble(options.machine).machine);
  const std::vector<BallbarTest> tests = ballbar_tests(nominal);
  make_result_folder(options.out);
  for (const std::string& name : options.tests) {
    const BallbarTest& test = test_named(tests, name);
    const std::vector<SingleError> errors = single_errors(nominal);
    std::vector<BallbarTrace> traces;
    for (const SingleError& error : errors) traces.push_back(pattern(nominal, test, error));
    std::vector<PolarCurve> curves;
    for (std::size_t i = 0; i < errors.size(); ++i)
      curves.push_back({&traces[i], errors[i].name + (errors[i].tilt ? " 0.01 deg" : " 10 µm")});
    const std::string path = options.out + "/pattern_" + name + ".svg";
    write_text_file(path, polar_plot("What each error looks like in test " + name, curves));
    fmt::print("{}\n", path);
  }
  return Exit::kDone;
}

std::vector<BallbarTrace> read_traces(const IdentifyOptions& options, const std::vector<BallbarTest>& tests) {
  std::vector<BallbarTrace> traces;
  for (const std::string& item : options.traces) {
    const std::size_t equals = item.find('=');
    const bool named = equals != std::string::npos;
    traces.push_back(
        read_ballbar_csv(named ? item.substr(equals + 1) : item, named ? item.substr(0, equals) : "", tests));
  }
  return traces;
}

std::string config_section(const BallbarFit& fit, const Machine& machine) {
  std::string out = "[corrections.geometric]\nenabled = true\nmode = \"full\"\n";
  int joint = -1;
  for (const BallbarParameter& p : fit.parameters) {
    const bool tilt = p.kind == BallbarParameter::Kind::kTilt;
    if (!tilt && p.kind != BallbarParameter::Kind::kOffset) continue;
    if (p.joint != joint)
      out += fmt::format("\n[[corrections.geometric.axis]]\njoint = \"{}\"\n",
                         machine.joints[static_cast<std::size_t>(p.joint)].name);
    joint = p.joint;
    out += fmt::format("{}_{} = {:.9g}\n", p.name.substr(p.name.find('.') + 1), tilt ? "arcsec" : "mm",
                       tilt ? p.value * kArcsecPerRad : p.value);
  }
  return out;
}

double shown(const BallbarParameter& p, double value) {
  return p.kind == BallbarParameter::Kind::kTilt ? value * kArcsecPerRad : 1000 * value;
}
const char* unit_of(const BallbarParameter& p) {
  return p.kind == BallbarParameter::Kind::kTilt ? "arcsec" : "um";
}

void print_correlation(const BallbarFit& fit) {
  if (fit.correlation.size() == 0) return;
  fmt::print("correlation\n");
  for (std::size_t i = 0; i < fit.fitted.size(); ++i) {
    fmt::print("  {:<12}", fit.parameters[static_cast<std::size_t>(fit.fitted[i])].name);
    for (std::size_t k = 0; k <= i; ++k)
      fmt::print(" {:6.3f}", fit.correlation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)));
    fmt::print("\n");
  }
}

void print_fit(const BallbarFit& fit, const std::vector<BallbarTrace>& traces) {
  fmt::print("error         value            standard error\n");
  for (const BallbarParameter& p : fit.parameters)
    if (p.unknown.empty())
      fmt::print("  {:<12}{:>14.6f} {:>14.6f} {}\n", p.name, shown(p, p.value), shown(p, p.deviation),
                 unit_of(p));
  for (const BallbarParameter& p : fit.parameters)
    if (!p.unknown.empty()) fmt::print("  {:<12} taken as 0: {}\n", p.name, p.unknown);
  print_correlation(fit);
  if (fit.before_mm.empty()) return;
  fmt::print("residual rms {:.6f} um, condition of the Jacobian {:.1f}\n", 1000 * fit.rms_mm, fit.condition);
  fmt::print("test         readings  deviation um  left um\n");
  for (std::size_t i = 0; i < traces.size(); ++i)
    fmt::print("{:<12} {:>8} {:>13.4f} {:>10.6f}\n", traces[i].test.name, traces[i].readings.size(),
               1000 * fit.before_mm[i], 1000 * fit.after_mm[i]);
}

void print_json(const BallbarFit& fit) {
  nlohmann::json out = {
      {"rms_mm", fit.rms_mm}, {"condition", fit.condition}, {"parameters", nlohmann::json::array()}};
  for (const BallbarParameter& p : fit.parameters) {
    const bool tilt = p.kind == BallbarParameter::Kind::kTilt;
    out["parameters"].push_back({{"name", p.name},
                                 {"unit", tilt ? "rad" : "mm"},
                                 {"value", p.value},
                                 {"standard_error", p.deviation},
                                 {"fitted", p.unknown.empty()},
                                 {"why_not", p.unknown}});
  }
  out["deviation_before_mm"] = fit.before_mm;
  out["deviation_left_mm"] = fit.after_mm;
  fmt::print("{}\n", out.dump(2));
}

Exit identify(const IdentifyOptions& options) {
  const Machine machine = assemble(options.machine).machine;
  const ActualChain nominal = read_chain(machine);
  const std::vector<BallbarTrace> traces = read_traces(options, ballbar_tests(nominal));
  BallbarFitOptions fit_options;
  fit_options.fit_setup = !options.no_setup;
  if (options.noise_um > 0) fit_options.noise_mm = options.noise_um / 1000;
  const BallbarFit fit =
      options.planar ? fit_planar(nominal, traces) : fit_ballbar(nominal, traces, fit_options);
  options.json ? print_json(fit) : print_fit(fit, traces);
  const std::string section = config_section(fit, machine);
  if (!options.write.empty())
    write_text_file(options.write, section);
  else if (!options.json)
    fmt::print("\n# for the config:\n{}", section);
  return Exit::kDone;
}

void add_ballbar_run(CLI::App& parent, Exit& exit) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* run_app = parent.add_subcommand(
      "run", "Run the tests on a simulated machine with errors; writes CSV and pictures");
  run_app->add_option("--machine,-m", options->machine, kMachineOption)->required();
  run_app->add_option("--truth", options->truth,
                      "the simulated machine's true errors: a file with a section [corrections.geometric]; "
                      "default: those the config knows");
  run_app->add_option("--out", options->out, "folder for programs, traces and pictures")
      ->capture_default_str();
  run_app->add_option("--tests", options->tests,
                      "a, a_extended, c, c_extended; for the planar method a_left, a_right, c_low, c_high");
  run_app->add_option("--noise-um", options->noise_um, "standard deviation of a reading")
      ->check(CLI::NonNegativeNumber);
  run_app->add_option("--resolution-um", options->resolution_um, "of the bar's encoder")
      ->check(CLI::NonNegativeNumber);
  run_app->add_option("--seed", options->seed, "of the noise");
  run_app->add_option("--ball-offset-mm", options->ball_offset_mm, "x y z in the table: set-up error")
      ->expected(3);
  run_app->add_option("--cup-offset-mm", options->cup_offset_mm, "x y z in the machine: set-up error")
      ->expected(3);
  run_app->add_flag("--every-period", options->every_period,
                    "a reading every period, not every 0.25 or 0.5 deg");
  run_app->callback([options, &exit] { exit = judging_measurements(&run, *options); });
}

void add_ballbar_patterns(CLI::App& parent, Exit& exit) {
  auto options = std::make_shared<RunOptions>();
  CLI::App* app =
      parent.add_subcommand("patterns", "Draw what each single error looks like in each test (SVG)");
  app->add_option("--machine,-m", options->machine, kMachineOption)->required();
  app->add_option("--out", options->out, "folder for the pictures")->capture_default_str();
  app->add_option("--tests", options->tests, "as in 'run'");
  app->callback([options, &exit] { exit = judging_measurements(&patterns, *options); });
}

void add_ballbar_identify(CLI::App& parent, Exit& exit) {
  auto options = std::make_shared<IdentifyOptions>();
  CLI::App* identify_app = parent.add_subcommand("identify",
                                                 "Find all errors of the rotary axes from traces that were "
                                                 "taken without compensation, and write the config");
  identify_app
      ->add_option("traces", options->traces,
                   "CSV files (angle in deg, reading in mm); NAME=FILE where the file does not say its test")
      ->required();
  identify_app->add_option("--machine,-m", options->machine, kMachineOption)->required();
  identify_app->add_flag("--planar", options->planar, "the two-position planar method, for comparison");
  identify_app->add_flag("--no-setup", options->no_setup, "take ball and cup as exactly in place");
  identify_app->add_option("--noise-um", options->noise_um, "of one reading; default: from the residuals");
  identify_app->add_option("--write", options->write, "write the config section to this file");
  identify_app->add_flag("--json", options->json, "report as JSON (mm, rad)");
  identify_app->callback([options, &exit] { exit = judging_measurements(&identify, *options); });
}

}  // namespace

void add_ballbar(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand(
      "ballbar", "Find the errors of a tilting rotary table by ball-bar tests, and rehearse these");
  command->require_subcommand(1);
  add_ballbar_run(*command, exit);
  add_ballbar_identify(*command, exit);
  add_ballbar_patterns(*command, exit);
}

}  // namespace trn
