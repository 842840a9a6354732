#include <fmt/format.h>

#include <cmath>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/cli/commands.h"
#include "app/cli/named_files.h"
#include "app/lab/ball_contacts.h"
#include "app/lab/ball_plan.h"
#include "app/lab/text_file.h"
#include "app/session/assembly.h"
#include "compensation/actual_chain.h"
#include "compensation/fit/ball_fit.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/motion.h"
#include "core/units.h"

namespace trn {

namespace {

constexpr double kUmPerMm = 1000;

struct FitOptions {
  std::string machine, write;
  std::vector<std::string> contacts;
  BallProbe probe;
  bool uncorrected = false, json = false;
};

struct PlanOptions {
  std::string machine;
  std::vector<std::string> contacts;
  std::vector<double> ball_mm;
  BallTouches touches;
  double noise_um = 1, tilt_max_deg = 90, latitude_deg = 30, step_deg = 15;
  int count = 8;
  bool json = false;
};

bool is_tilt(const BallParameter& p) { return p.kind == BallParameter::Kind::kTilt; }
double shown(const BallParameter& p, double value) { return value * (is_tilt(p) ? kArcsecPerRad : kUmPerMm); }
const char* unit_of(const BallParameter& p) { return is_tilt(p) ? "arcsec" : "um"; }
bool is_place(const BallParameter& p) {
  return p.kind == BallParameter::Kind::kBall || p.kind == BallParameter::Kind::kRadius;
}

// The machine as it is known; ConfigError where it has no axis to measure.
ActualChain chain_to_measure(const Machine& machine) {
  const ActualChain chain = known_chain(machine);
  for (const Joint& joint : machine.joints)
    if (joint.kind == JointKind::kRotary) return chain;
  throw machine.root.error("joint", "no joint is rotary: there is nothing that a ball could tell");
}

std::vector<BallContact> read_all(const std::vector<std::string>& files, const Assembly& assembly,
                                  std::uint8_t corrections_off, const BallProbe& probe) {
  std::vector<BallContact> contacts;
  for (const std::string& file : files)
    for (const BallContact& contact : read_ball_contacts(file, assembly, corrections_off, probe))
      contacts.push_back(contact);
  return contacts;
}

// Values of the machine as the config has them, in the order of the fit.
std::vector<double> known_values(ActualChain chain, const BallFit& fit) {
  std::vector<double> out;
  for (const BallParameter& p : fit.parameters) {
    const ActualAxis* axis = p.joint >= 0 ? find_axis(chain, p.joint) : nullptr;
    out.push_back(axis ? (is_tilt(p) ? axis->location.tilt : axis->location.offset)[p.component] : 0);
  }
  return out;
}

void print_fit(const BallFit& fit, const std::vector<double>& known) {
  fmt::print(
      "{} contacts, rms distance from one sphere: {:.2f} um as the machine was known, one touch {:.2f} um\n",
      fit.residual_mm.size(), kUmPerMm * fit.before_mm, kUmPerMm * fit.noise_mm);
  fmt::print("error              value   standard error    config has\n");
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    const BallParameter& p = fit.parameters[i];
    if (!p.unknown.empty() || is_place(p)) continue;
    fmt::print("  {:<10} {:>11.3f} {:>14.3f} {:>13.3f} {}\n", p.name, shown(p, p.value),
               shown(p, p.deviation), shown(p, known[i]), unit_of(p));
  }
  for (const BallParameter& p : fit.parameters)
    if (p.unknown.empty() && is_place(p))
      fmt::print("  {:<13} {:.4f} mm, standard error {:.2f} um\n", p.name, p.value, kUmPerMm * p.deviation);
  for (const BallParameter& p : fit.parameters)
    if (!p.unknown.empty()) fmt::print("  {:<13} kept as it was: {}\n", p.name, p.unknown);
  fmt::print("condition of the Jacobian {:.1f}\n", fit.condition);
}

nlohmann::json fit_json(const BallFit& fit, const std::vector<double>& known) {
  nlohmann::json out = {{"contacts", fit.residual_mm.size()}, {"before_mm", fit.before_mm},
                        {"noise_mm", fit.noise_mm},           {"condition", fit.condition},
                        {"residual_mm", fit.residual_mm},     {"parameters", nlohmann::json::array()}};
  for (std::size_t i = 0; i < fit.parameters.size(); ++i) {
    const BallParameter& p = fit.parameters[i];
    out["parameters"].push_back({{"name", p.name},
                                 {"unit", is_tilt(p) ? "rad" : "mm"},
                                 {"value", p.value},
                                 {"standard_error", p.deviation},
                                 {"config", known[i]},
                                 {"fitted", p.unknown.empty()},
                                 {"why_not", p.unknown}});
  }
  return out;
}

Exit fit(const FitOptions& options) {
  const Assembly assembly = assemble(options.machine);
  const ActualChain known = chain_to_measure(assembly.machine);
  auto off = static_cast<std::uint8_t>(assembly.corrections.planned_off);
  if (options.uncorrected) off |= kGeometricBit;
  const BallFit fit = fit_ball(known, read_all(options.contacts, assembly, off, options.probe));
  const std::vector<double> values = known_values(known, fit);
  if (options.json)
    fmt::print("{}\n", fit_json(fit, values).dump(2));
  else
    print_fit(fit, values);
  const std::string section = ball_config_section(fit, assembly.machine);
  if (!options.write.empty())
    write_text_file(options.write, section);
  else if (!options.json)
    fmt::print("\n# for the config, in the place of these axes' tables:\n{}", section);
  return Exit::kDone;
}

// Degrees without the rounding of the way from radians, and without a negative zero.
double whole(double angle_rad) { return std::round(angle_rad * kDegPerRad * 1e6) / 1e6 + 0.0; }

// The letters of the rotary words that the machine has, as "A-45 C90".
std::string words_text(const Assembly& assembly, const Vec3& abc_rad) {
  std::string text;
  for (int k = kA; k <= kC; ++k)
    if (assembly.kinematics->word_mask() >> k & 1u)
      text += fmt::format("{}{}{:g}", text.empty() ? "" : " ", kWordLetters[k], whole(abc_rad[k - kA]));
  return text;
}

void print_plan(const Assembly& assembly, const BallInformation& information, double start_mm,
                const std::vector<double>& before, const std::vector<BallPosition>& plan, bool any_before) {
  fmt::print("standard error of the axes (root of the mean square; a tilt as its shift at 100 mm)\n");
  fmt::print("  {:<18} {:>10}\n", "position", "um");
  fmt::print("  {:<18} {:>10.3f}\n", any_before ? "contacts so far" : "nothing yet", kUmPerMm * start_mm);
  for (const BallPosition& position : plan)
    fmt::print("  {:<18} {:>10.3f}\n", words_text(assembly, position.abc_rad), kUmPerMm * position.axes_mm);
  const std::vector<double> after = information.deviations();
  fmt::print("standard error of each\n");
  for (std::size_t i = 0; i < after.size(); ++i) {
    const BallParameter& p = information.parameters()[i];
    if (is_place(p)) continue;
    // What stays near the millimetre with which a plan begins is not told by any of the touches.
    const bool told = after[i] * (is_tilt(p) ? 100 : 1) < 0.1;
    fmt::print(
        "  {:<8} {:>12} -> {}\n", p.name, any_before ? fmt::format("{:.3f}", shown(p, before[i])) : "-",
        told ? fmt::format("{:.3f} {}", shown(p, after[i]), unit_of(p)) : "not told by these positions");
  }
  const unsigned both = 1u << kA | 1u << kC;
  if ((assembly.kinematics->word_mask() & (both | 1u << kB)) != both) return;
  fmt::print("lines for examples/probing/ball_calibration.ngc:\n");
  for (const BallPosition& position : plan)
    fmt::print("o<probe_ball> call [{:g}] [{:g}]\n", whole(position.abc_rad[0]), whole(position.abc_rad[2]));
}

void print_plan_json(const BallInformation& information, double start_mm,
                     const std::vector<BallPosition>& plan) {
  nlohmann::json out = {{"axes_before_mm", start_mm}, {"positions", nlohmann::json::array()}};
  for (const BallPosition& position : plan)
    out["positions"].push_back({{"a_deg", position.abc_rad[0] * kDegPerRad},
                                {"b_deg", position.abc_rad[1] * kDegPerRad},
                                {"c_deg", position.abc_rad[2] * kDegPerRad},
                                {"axes_mm", position.axes_mm}});
  const std::vector<double> after = information.deviations();
  for (std::size_t i = 0; i < after.size(); ++i)
    out["standard_error"][information.parameters()[i].name] = after[i];
  fmt::print("{}\n", out.dump(2));
}

Exit plan(const PlanOptions& options) {
  const Assembly assembly = assemble(options.machine);
  const ActualChain known = chain_to_measure(assembly.machine);
  BallTouches touches = options.touches;
  touches.tilt_max_rad = options.tilt_max_deg * kRadPerDeg;
  touches.latitude_rad = options.latitude_deg * kRadPerDeg;
  touches.step_rad = options.step_deg * kRadPerDeg;
  touches.ball_M = Vec3(options.ball_mm.data());
  const Vec3 ball_B = assembly.kinematics->home_X_BM() * touches.ball_M;
  BallInformation information(known, ball_B, (touches.diameter_mm + touches.tip_mm) / 2,
                              options.noise_um / kUmPerMm);
  information.add(read_all(options.contacts, assembly,
                           static_cast<std::uint8_t>(assembly.corrections.planned_off),
                           {touches.length_mm, touches.tip_mm}));
  const double start_mm = information.axes_mm();
  const std::vector<double> before = information.deviations();
  const std::vector<BallPosition> next =
      plan_ball(ball_positions(assembly, touches), options.count, information);
  if (options.json)
    print_plan_json(information, start_mm, next);
  else
    print_plan(assembly, information, start_mm, before, next, !options.contacts.empty());
  return Exit::kDone;
}

void add_ball_fit(CLI::App& parent, Exit& exit) {
  auto options = std::make_shared<FitOptions>();
  CLI::App* app = parent.add_subcommand(
      "fit",
      "Find the errors of the rotary axes from contacts of a ball, and write the section for the config");
  app->add_option(
         "contacts", options->contacts,
         "CSV files of examples/probing/ball_calibration.ngc: a line a touch, x_mm y_mm z_mm a_deg c_deg as "
         "G53 calls the place, length_mm and tip_mm of the probe")
      ->required();
  app->add_option("--machine,-m", options->machine,
                  "the machine by its name, or its config (.toml): the one that was in force when the ball "
                  "was touched")
      ->required();
  app->add_option("--length-mm", options->probe.length_mm,
                  "length of the probe, where the file has no such column");
  app->add_option("--tip-mm", options->probe.tip_mm, "diameter of its ball, the same");
  app->add_flag("--uncorrected", options->uncorrected,
                "the config's [corrections.geometric] was switched off while the ball was touched");
  app->add_option("--write", options->write, "write the config section to this file");
  app->add_flag("--json", options->json, "report as JSON (mm, rad)");
  app->footer(
      "Fitted on the exact chain: four errors of each rotary axis (docs/corrections.md), the ball's centre, "
      "the\n"
      "sum of the radii of ball and tip. What the positions cannot tell keeps the config's value and says "
      "what it\n"
      "acts like. On a turning table a probe that is too long, or does not run true, acts like a shift of "
      "the axes.\n"
      "Exit codes: 0 done, 2 bad contacts, 3 bad config, 5 usage.");
  app->callback([options, &exit] { exit = judging_measurements(&fit, *options); });
}

void add_ball_plan(CLI::App& parent, Exit& exit) {
  auto options = std::make_shared<PlanOptions>();
  CLI::App* app = parent.add_subcommand(
      "plan",
      "Say in which positions of the rotary axes it is worth touching the ball next, and by how much");
  app->add_option("--machine,-m", options->machine, kMachineOption)->required();
  app->add_option("--ball", options->ball_mm,
                  "x y z of the ball's centre, machine coordinates with every axis at zero")
      ->expected(3)
      ->required();
  app->add_option("--contacts", options->contacts, "what has been touched already (CSV as for 'fit')");
  app->add_option("--count", options->count, "how many positions")
      ->check(CLI::Range(1, 100))
      ->capture_default_str();
  BallTouches& touches = options->touches;
  app->add_option("--length-mm", touches.length_mm, "length of the probe")->capture_default_str();
  app->add_option("--tip-mm", touches.tip_mm, "diameter of its ball")->capture_default_str();
  app->add_option("--diameter-mm", touches.diameter_mm, "of the ball on the table")->capture_default_str();
  app->add_option("--clearance-mm", touches.clearance_mm, "air around the ball")->capture_default_str();
  app->add_option("--sides", touches.sides, "touches around the top")
      ->check(CLI::Range(0, 36))
      ->capture_default_str();
  app->add_option("--latitude-deg", options->latitude_deg, "of these touches on the ball")
      ->check(CLI::Range(-30.0, 80.0))
      ->capture_default_str();
  app->add_option("--tilt-max-deg", options->tilt_max_deg, "of the tool from the ball's stem")
      ->check(CLI::Range(0.0, 150.0))
      ->capture_default_str();
  app->add_option("--step-deg", options->step_deg, "between the angles that are looked at")
      ->check(CLI::Range(1.0, 90.0))
      ->capture_default_str();
  app->add_option("--noise-um", options->noise_um, "standard deviation of one touch")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app->add_flag("--json", options->json, "report as JSON (mm, rad, deg)");
  app->footer(
      "Every position within the joints' ranges is tried in turn; the one that leaves the least of the axes' "
      "mean\n"
      "variance is next (A-optimal). Exit codes: 0 done, 2 bad contacts, 3 bad config, 5 usage.");
  app->callback([options, &exit] { exit = judging_measurements(&plan, *options); });
}

}  // namespace

void add_ball(CLI::App& app, Exit& exit) {
  CLI::App* command = app.add_subcommand(
      "ball", "Find the errors of the rotary axes from a ball that the probe touches in many positions");
  command->require_subcommand(1);
  add_ball_fit(*command, exit);
  add_ball_plan(*command, exit);
}

}  // namespace trn
