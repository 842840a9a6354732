#include "core/joint_model.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "core/check.h"
#include "core/units.h"

namespace trn {

namespace {

// Newton over mm/s^2 is tonnes.
constexpr double kTonnesPerKg = 1e-3;

double cogging_at(const JointModel& model, double q) TRN_RT {
  const std::size_t count = model.cogging.size();
  if (count == 0) return 0;
  TRN_CHECK(model.cogging_pitch > 0);
  const double turns = q / model.cogging_pitch;
  const double place = (turns - std::floor(turns)) * static_cast<double>(count);
  const auto left = std::min(static_cast<std::size_t>(place), count - 1);
  const double part = place - static_cast<double>(left);
  return model.cogging[left] + part * (model.cogging[(left + 1) % count] - model.cogging[left]);
}

// Without the ramp the drive would be pushed to and fro at every standstill.
double coulomb_at(const JointModel& model, double qd) TRN_RT {
  if (std::abs(qd) >= model.coulomb_speed) return std::copysign(qd == 0 ? 0.0 : model.coulomb, qd);
  return model.coulomb * qd / model.coulomb_speed;
}

// No axis has masses or forces beyond these, and the sums of smaller ones stay numbers.
constexpr Range kOfMachines{0, 1e9}, kEitherWay{-1e9, 1e9};

void read_cogging(const ConfigTable& table, bool rotary, JointModel& model) {
  const std::string at = rotary ? "cogging_pitch_deg" : "cogging_pitch_mm";
  const std::string key = rotary ? "cogging_Nm" : "cogging_N";
  if (!table.has(key)) {
    if (table.has(at)) throw table.error(at, fmt::format("'{}' needs its table '{}'", at, key));
    return;
  }
  model.cogging_pitch = (rotary ? kRadPerDeg : 1) * table.number(at, kPositive);
  model.cogging = table.numbers(key);
  if (model.cogging.size() < 2 || model.cogging.size() > 4096)
    throw table.error(key, fmt::format("'{}' has 2 to 4096 values over one pitch", key));
  for (const double value : model.cogging)
    if (std::abs(value) > kEitherWay.max)
      throw table.error(
          key, fmt::format("'{}' has a value {:g} that is out of range: -1e9 to 1e9 is legal", key, value));
}

void read_linear(const ConfigTable& table, JointModel& model) {
  model.inertia = kTonnesPerKg * table.number("inertia_kg", 0.0, kOfMachines);
  model.viscous = table.number("viscous_N_s_mm", 0.0, kOfMachines);
  model.coulomb = table.number("coulomb_N", 0.0, kOfMachines);
  model.coulomb_speed = table.number("coulomb_speed_mm_s", 0.1, kNotNegative);
  model.gravity = table.number("gravity_N", 0.0, kEitherWay);
  read_cogging(table, false, model);
}

void read_rotary(const ConfigTable& table, JointModel& model) {
  model.inertia = table.number("inertia_kg_m2", 0.0, kOfMachines);
  model.viscous = table.number("viscous_Nm_s", 0.0, kOfMachines);
  model.coulomb = table.number("coulomb_Nm", 0.0, kOfMachines);
  model.coulomb_speed = kRadPerDeg * table.number("coulomb_speed_deg_s", 0.1, kNotNegative);
  model.gravity = table.number("gravity_Nm", 0.0, kEitherWay);
  const double imbalance = table.number("imbalance_Nm", 0.0, kOfMachines);
  const double at = kRadPerDeg * table.number("imbalance_at_deg", 0.0, Range{-360, 360});
  model.imbalance_cos = imbalance * std::cos(at);
  model.imbalance_sin = imbalance * std::sin(at);
  read_cogging(table, true, model);
}

}  // namespace

double JointModel::force_at_rest(double q) const TRN_RT {
  double sum = gravity + cogging_at(*this, q);
  if (imbalance_cos != 0 || imbalance_sin != 0)
    sum += imbalance_cos * std::cos(q) + imbalance_sin * std::sin(q);
  return sum;
}

double JointModel::force(double q, double qd, double qdd) const TRN_RT {
  return inertia * qdd + viscous * qd + coulomb_at(*this, qd) + force_at_rest(q);
}

std::optional<FeedForwardConfig> read_feed_forward(const Machine& machine) {
  const auto section = machine.root.table_if("feed_forward");
  if (!section) return std::nullopt;
  FeedForwardConfig config;
  config.velocity = section->boolean("velocity", true);
  config.torque = section->boolean("torque", true);
  config.delay_periods = section->number("delay_periods", -0.5, Range{-1, 8});
  config.models.resize(machine.joints.size());
  std::vector<std::string> names;
  for (const Joint& joint : machine.joints) names.push_back(joint.name);
  for (const ConfigTable& table : section->tables_if("joint")) {
    const std::string name = table.choice("joint", names);
    const auto i = static_cast<std::size_t>(std::find(names.begin(), names.end(), name) - names.begin());
    if (config.models[i]) throw table.error("joint", fmt::format("joint '{}' has a model already", name));
    JointModel model;
    machine.joints[i].kind == JointKind::kRotary ? read_rotary(table, model) : read_linear(table, model);
    config.models[i] = model;
  }
  return config;
}

}  // namespace trn
