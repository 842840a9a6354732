#include "app/lab/tune/tune_report.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <string_view>
#include <vector>

#include "app/lab/tune/tune_stirred.h"
#include "core/units.h"

namespace trn {

namespace {

constexpr double kKgPerTonne = 1000;  // N over mm/s^2 is tonnes

/// A number of the model as the config and people have it.
struct TuneLine {
  std::string_view key, meaning, unit;
  TuneValue value;
};

TuneValue scaled(const TuneValue& value, double by) {
  return {by * value.value, std::abs(by) * value.deviation};
}

TuneValue imbalance_of(const TuneFit& fit) {
  const double size = std::hypot(fit.imbalance_cos.value, fit.imbalance_sin.value);
  return {size, std::hypot(fit.imbalance_cos.deviation, fit.imbalance_sin.deviation)};
}

std::vector<TuneLine> lines_of(const TuneFit& fit, const Joint& joint) {
  if (joint.kind != JointKind::kRotary)
    return {{"inertia_kg", "mass", "kg", scaled(fit.inertia, kKgPerTonne)},
            {"viscous_N_s_mm", "viscous friction", "N s/mm", fit.viscous},
            {"coulomb_N", "Coulomb friction", "N", fit.coulomb},
            {"gravity_N", "weight", "N", fit.gravity}};
  const double at_deg = kDegPerRad * std::atan2(fit.imbalance_sin.value, fit.imbalance_cos.value);
  std::vector<TuneLine> out = {{"inertia_kg_m2", "inertia", "kg m^2", fit.inertia},
                               {"viscous_Nm_s", "viscous friction", "Nm s", fit.viscous},
                               {"coulomb_Nm", "Coulomb friction", "Nm", fit.coulomb},
                               {"gravity_Nm", "even weight", "Nm", fit.gravity}};
  const TuneValue imbalance = imbalance_of(fit);
  if (imbalance.value > 3 * imbalance.deviation) {
    out.push_back({"imbalance_Nm", "imbalance", "Nm", imbalance});
    out.push_back({"imbalance_at_deg",
                   "greatest at",
                   "deg",
                   {at_deg, kDegPerRad * imbalance.deviation / imbalance.value}});
  }
  return out;
}

// What is not certain does not belong in a config.
bool certain(const TuneLine& line) {
  return std::abs(line.value.value) > 2 * line.value.deviation || line.key.substr(0, 7) == "inertia" ||
         line.key == "imbalance_at_deg";
}

double joint_unit(const Joint& joint) { return joint.kind == JointKind::kRotary ? kDegPerRad : 1; }
std::string_view joint_unit_name(const Joint& joint) {
  return joint.kind == JointKind::kRotary ? "deg" : "mm";
}

// As the config's table has it: at even places of the pitch, from 0 on.
std::vector<double> cogging_table(const TuneFit& fit) {
  constexpr int kPlaces = 64;
  std::vector<double> out;
  for (int i = 0; i < kPlaces; ++i) out.push_back(fit.cogging_at(fit.cogging_pitch * i / kPlaces));
  return out;
}

std::string cogging_text(const TuneFit& fit, const Joint& joint) {
  if (fit.cogging_pitch <= 0) return "";
  const std::string_view unit = joint.kind == JointKind::kRotary ? "Nm" : "N";
  std::string out;
  for (std::size_t i = 0; i < fit.cogging_cos.size(); ++i) {
    const double size = std::hypot(fit.cogging_cos[i].value, fit.cogging_sin[i].value);
    const double deviation = std::hypot(fit.cogging_cos[i].deviation, fit.cogging_sin[i].deviation);
    if (size > 4 * deviation)
      out += fmt::format("  {:<18} {:>12.5g} +- {:<10.2g} {}, {} in a pitch\n", "cogging", size, deviation,
                         unit, i + 1);
  }
  return out.empty() ? fmt::format("  {:<18} {:>12}  (none that is certain)\n", "cogging", "") : out;
}

std::string stirred_text(const TuneLoop& loop) {
  if (!loop.stirred) return "";
  const StirredLoop& s = *loop.stirred;
  const std::string limit =
      fmt::format("looked at up to {:.0f} Hz; the period allows for {:.0f}", s.seen_up_to_hz, s.nyquist_hz);
  if (s.resonance_hz <= 0)
    return fmt::format("  {:<18} {:>12}  ({})\n", "shaken", "", "nothing swings, " + limit);
  return fmt::format("  {:<18} {:>12.4g} +- {:<10.2g} Hz, damping {:.3f}, load's share {:.2f} ({})\n",
                     "resonance, shaken", s.resonance_hz, s.deviation_hz, s.damping, s.share, limit);
}

std::string jerk_text(const TuneResult& result, const Joint& joint) {
  const double unit = joint_unit(joint);
  const std::string_view name = joint_unit_name(joint);
  const auto jerk = recommended_jerk(result.loop, joint);
  if (!jerk)
    return fmt::format(
        "No resonance was seen up to {:.0f} Hz; faster ones the motions do not stir. The jerk limit of "
        "{:.6g} "
        "{}/s^3\nmay stay.\n",
        result.loop.seen_up_to_hz, unit * joint.limit.jerk, name);
  const double swing = result.loop.swing_hz.value_or(result.loop.resonance_hz.value_or(0));
  return fmt::format(
      "The load swings at {:.1f} Hz. A jerk of {:.4g} {}/s^3 lets the acceleration of {:.6g} {}/s^2 come up "
      "within one\nswing, so that none is left behind. The config has {:.6g}{}\n",
      swing, unit * *jerk, name, unit * joint.limit.acceleration, name, unit * joint.limit.jerk,
      *jerk < joint.limit.jerk ? ": more than that." : ", which is gentler.");
}

}  // namespace

std::string tune_text(const TuneResult& result, const Joint& joint) {
  const std::string_view name = joint_unit_name(joint);
  std::string out = fmt::format("Joint {}, {} periods; the model explains {:.2f} % of the force\n",
                                joint.name, result.fit.rows, 100 * result.fit.explained);
  for (const TuneLine& line : lines_of(result.fit, joint))
    out += fmt::format("  {:<18} {:>12.5g} +- {:<10.2g} {}{}\n", line.meaning, line.value.value,
                       line.value.deviation, line.unit, certain(line) ? "" : "  (none that is certain)");
  out += cogging_text(result.fit, joint) + stirred_text(result.loop);
  if (result.lost_motion)
    out += fmt::format("  {:<18} {:>12.5g} +- {:<10.2g} {}\n", "lost motion",
                       joint_unit(joint) * result.lost_motion->value,
                       joint_unit(joint) * result.lost_motion->deviation, name);
  if (result.loop.bandwidth_hz)
    out += fmt::format("  {:<18} {:>12.4g} Hz\n", "loop's bandwidth", *result.loop.bandwidth_hz);
  if (result.loop.resonance_hz)
    out += fmt::format("  {:<18} {:>12.4g} Hz, motor against load\n", "resonance", *result.loop.resonance_hz);
  return out + jerk_text(result, joint);
}

std::string tune_json(const TuneResult& result, const Joint& joint) {
  nlohmann::ordered_json out{
      {"joint", joint.name}, {"rows", result.fit.rows}, {"explained", result.fit.explained}};
  for (const TuneLine& line : lines_of(result.fit, joint))
    out[std::string(line.key)] = {{"value", line.value.value}, {"deviation", line.value.deviation}};
  const double unit = joint_unit(joint);
  const std::string name(joint_unit_name(joint));
  if (result.lost_motion) out["lost_motion_" + name] = unit * result.lost_motion->value;
  if (result.loop.bandwidth_hz) out["bandwidth_hz"] = *result.loop.bandwidth_hz;
  if (result.fit.cogs()) {
    out["cogging_pitch_" + name] = unit * result.fit.cogging_pitch;
    out["cogging"] = cogging_table(result.fit);
  }
  if (const auto& stirred = result.loop.stirred)
    out["shaken"] = {{"resonance_hz", stirred->resonance_hz},
                     {"deviation_hz", stirred->deviation_hz},
                     {"damping", stirred->damping},
                     {"load_share", stirred->share},
                     {"seen_up_to_hz", stirred->seen_up_to_hz}};
  if (result.loop.swing_hz) out["swing_hz"] = *result.loop.swing_hz;
  if (result.loop.resonance_hz) out["resonance_hz"] = *result.loop.resonance_hz;
  if (const auto jerk = recommended_jerk(result.loop, joint)) out["jerk_" + name + "_s3"] = unit * *jerk;
  return out.dump(2) + "\n";
}

std::vector<TuneKey> tune_keys(const TuneResult& result, const Joint& joint) {
  std::vector<TuneKey> out;
  for (const TuneLine& line : lines_of(result.fit, joint))
    if (certain(line)) out.push_back({std::string(line.key), line.value.value, line.value.deviation});
  return out;
}

std::string tune_line(const TuneResult& result, const Joint& joint) {
  std::string out;
  for (const TuneLine& line : lines_of(result.fit, joint))
    if (certain(line))
      out +=
          fmt::format("{}{} {:.4g} {}", out.empty() ? "" : ", ", line.meaning, line.value.value, line.unit);
  if (result.loop.bandwidth_hz) out += fmt::format(", bandwidth {:.3g} Hz", *result.loop.bandwidth_hz);
  const auto swing = result.loop.swing_hz ? result.loop.swing_hz : result.loop.resonance_hz;
  if (swing) out += fmt::format(", the load swings at {:.3g} Hz", *swing);
  return out;
}

std::string tune_config(const TuneResult& result, const Joint& joint) {
  std::string out =
      fmt::format("[[feed_forward.joint]]   # by trunnion tune {}\njoint = \"{}\"\n", joint.name, joint.name);
  for (const TuneLine& line : lines_of(result.fit, joint))
    if (certain(line)) out += fmt::format("{} = {:.6g}\n", line.key, line.value.value);
  if (!result.fit.cogs()) return out;
  const bool rotary = joint.kind == JointKind::kRotary;
  out += fmt::format("cogging_pitch_{} = {:.6g}\ncogging_{} = [{:.4g}]\n", joint_unit_name(joint),
                     joint_unit(joint) * result.fit.cogging_pitch, rotary ? "Nm" : "N",
                     fmt::join(cogging_table(result.fit), ", "));
  return out;
}

}  // namespace trn
