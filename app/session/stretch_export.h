#pragma once

#include <functional>
#include <iosfwd>
#include <span>

#include "core/axes.h"
#include "core/path.h"
#include "core/ports.h"
#include "interp/plan/stages.h"

namespace trn {

/// Samples the joint path of one stretch, as planned, about each `step` of the path parameter, and at every
/// border of pieces: calls row(s, q, tip), s and tip (length of the tip's way in the work, mm) from the
/// stretch's start. At least 16 steps a piece unless the piece is shorter than step / 16. Throws ProgramError
/// where the map fails.
void sample_stretch(std::span<const PlanPiece> stretch, const JointMap& map, double step,
                    const std::function<void(double s, const JointVec& q, double tip)>& row);

/// Length of the tip's way in the work along a piece, mm.
double tip_length(const PathPiece& piece);

/// Writes stretches as CSV: header "s,<joints>,tip", then rows with 17 digits, a blank line between
/// stretches.
class StretchWriter {
 public:
  /// Both must outlive the writer.
  StretchWriter(std::ostream& out, const Joints& joints);
  void write(std::span<const PlanPiece> stretch, const JointMap& map, double step);

 private:
  std::ostream& out_;
  bool first_ = true;
};

}  // namespace trn
