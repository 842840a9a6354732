#include "app/session/feature_meter.h"

#include <cmath>

#include "core/units.h"

namespace trn {

namespace {
constexpr double kSame = 1e-6;  // mm: of two arcs of one circle
}

void FeatureMeter::arc(const ProgramMove& move) {
  const double diameter_mm = 2 * (move.from.head<3>() - move.arc_centre).head<2>().norm();
  Feature* last = features_.empty() ? nullptr : &features_.back();
  const bool goes_on = last && last->result.circle && std::abs(last->sweep_rad) < 2 * kPi - kSame &&
                       (last->centre - move.arc_centre).head<2>().norm() < kSame &&
                       std::abs(last->result.size_mm - diameter_mm) < kSame;
  if (!goes_on) {
    Feature feature;
    feature.result.line = move.source.line;
    feature.result.circle = true;
    feature.result.size_mm = diameter_mm;
    feature.centre = move.arc_centre;
    features_.push_back(feature);
  }
  features_.back().result.last_line = move.source.line;
  features_.back().sweep_rad += move.arc_sweep_rad;
}

void FeatureMeter::programmed(const ProgramMove& move) {
  const Vec3 way = (move.to - move.from).head<3>();
  const bool flat = std::abs(way.z()) < 1e-9;
  if (!flat || features_.size() >= kFeaturesMax || move.kind == ProgramMove::Kind::kTraverse) return;
  if (move.kind == ProgramMove::Kind::kArc) {
    if (std::abs(move.arc_axis.z()) > 0.999) arc(move);
    return;
  }
  if (way.norm() < kLengthMin) return;
  Feature feature;
  feature.result.line = feature.result.last_line = move.source.line;
  feature.result.size_mm = way.norm();
  feature.left = Vec3(-way.y(), way.x(), 0) / way.norm();
  features_.push_back(feature);
}

void FeatureMeter::sample(const CycleReport& report) {
  if (!report.on_path) return;
  const auto holds = [&](const Feature& feature) {
    return report.line >= feature.result.line && report.line <= feature.result.last_line;
  };
  std::size_t at = at_;
  while (at < features_.size() && !holds(features_[at])) ++at;
  if (at == features_.size()) return;  // between features
  at_ = at;
  Feature& feature = features_[at];
  Vec3 out = feature.left;
  if (feature.result.circle)
    out = (report.y.head<3>() - feature.centre).cwiseProduct(Vec3(1, 1, 0)).normalized();
  const ToolLoadReport& load = report.tool_load;
  feature.bending_sum_mm += load.deflection_mm.dot(out.head<2>());
  feature.offset_sum_mm += (load.deflection_mm + load.shift_mm).dot(out.head<2>());
  feature.unknown += load.known ? 0 : 1;
  ++feature.periods;
}

std::vector<FeatureDeflection> FeatureMeter::features() const {
  std::vector<FeatureDeflection> out;
  for (const Feature& feature : features_) {
    const bool open = feature.result.circle && std::abs(feature.sweep_rad) < 2 * kPi - kSame;
    if (feature.periods == 0 || open) continue;
    const auto n = static_cast<double>(feature.periods);
    out.push_back(feature.result);
    out.back().bending_mm = feature.bending_sum_mm / n;
    out.back().offset_mm = feature.offset_sum_mm / n;
    out.back().unknown = static_cast<double>(feature.unknown) / n;
  }
  return out;
}

}  // namespace trn
