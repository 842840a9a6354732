#include "app/session/stretch_export.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ostream>

#include "interp/move.h"

namespace trn {

namespace {

// Length of the tip's way over [s0, s1] of a piece: three-point Gauss rule.
double tip_length(const PathPiece& piece, double s0, double s1) {
  const double mid = (s0 + s1) / 2, half = (s1 - s0) / 2, offset = half * std::sqrt(0.6);
  const auto speed = [&](double s) { return piece.derivatives(s).d1.head<3>().norm(); };
  return half * (5 * speed(mid - offset) + 8 * speed(mid) + 5 * speed(mid + offset)) / 9;
}

}  // namespace

double tip_length(const PathPiece& piece) {
  constexpr int kParts = 16;
  double sum = 0;
  for (int i = 0; i < kParts; ++i)
    sum += tip_length(piece, piece.length * i / kParts, piece.length * (i + 1) / kParts);
  return sum;
}

void sample_stretch(std::span<const PlanPiece> stretch, const JointMap& map, double step,
                    const std::function<void(double s, const JointVec& q, double tip)>& row) {
  double s = 0, tip = 0;
  JointVec q;
  for (size_t k = 0; k < stretch.size(); ++k) {
    const PlanPiece& plan = stretch[k];
    const double length = plan.piece.length, fine = std::min(step, std::max(length / 16, step / 16));
    const int n = std::max(1, static_cast<int>(std::ceil(length / fine)));
    for (int i = k == 0 ? 0 : 1; i <= n; ++i) {
      const double here = length * i / n;
      if (i > 0) tip += tip_length(plan.piece, length * (i - 1) / n, here);
      const KinStatus status = map.map(plan.piece.at(here), plan.context, q);
      if (status != KinStatus::kOk)
        throw ProgramError(fmt::format("line {}: the machine cannot follow the path here: {}",
                                       plan.source.line, to_string(status)));
      row(s + here, q, tip);
    }
    s += length;
  }
}

StretchWriter::StretchWriter(std::ostream& out, const Joints& joints) : out_(out) {
  out_ << "s";
  for (const Joint& joint : joints) out_ << ',' << joint.name;
  out_ << ",tip\n";
}

void StretchWriter::write(std::span<const PlanPiece> stretch, const JointMap& map, double step) {
  if (!first_) out_ << '\n';
  first_ = false;
  sample_stretch(stretch, map, step, [&](double s, const JointVec& q, double tip) {
    out_ << fmt::format("{:.17g}", s);
    for (int i = 0; i < q.size(); ++i) out_ << fmt::format(",{:.17g}", q[i]);
    out_ << fmt::format(",{:.17g}\n", tip);
  });
}

}  // namespace trn
