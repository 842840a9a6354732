#pragma once

#include <vector>

#include "compensation/spline.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/machine.h"
#include "core/ports.h"

namespace trn {

/// Measured error of one joint: how far beyond its setpoint the axis really goes, at places along the joint,
/// driven forward and driven backward (mm or rad). A slope is the table of a scale error, backlash a constant
/// gap of the two directions: driven forward the axis lags behind by half of it, driven backward it leads.
struct JointTable {
  int joint = 0;
  double slope = 0;          ///< the setpoint is to be multiplied by 1 + slope (docs/sources.md S4.3)
  double backlash = 0;       ///< >= 0
  double hysteresis = 1e-3;  ///< a joint has reversed when it has gone back by this much
  Spline mean;               ///< error, mean of both directions
  Spline half_gap;           ///< half of backward less forward

  /// `correction` is added to the setpoint q whatever the direction. `gap` is added on top of that on the way
  /// forward and taken off on the way backward.
  double correction(double q) const TRN_RT { return slope * q - mean.at(q); }
  double gap(double q) const TRN_RT { return backlash / 2 + half_gap.at(q); }
};

/// The part of the tables that does not depend on the direction of motion; inside the plan.
class JointTables final : public JointCorrection {
 public:
  explicit JointTables(std::vector<JointTable> tables) : tables_(std::move(tables)) {}
  void correct(JointVec& q) const TRN_RT override;
  void undo(JointVec& q) const TRN_RT override;

 private:
  std::vector<JointTable> tables_;
};

/// The part that depends on it: added on reversal, behind the plan.
class BacklashCorrection final : public SetpointCorrection {
 public:
  explicit BacklashCorrection(std::vector<JointTable> tables);
  void wanted(const CorrectionInput& input, JointVec& offset) TRN_RT override;
  unsigned joint_mask() const override;

 private:
  struct Play {
    JointTable table;
    double edge = 0;  ///< the furthest place in the present direction
    int direction = 0;
  };
  std::vector<Play> plays_;
};

/// Section [corrections.joint_table]: one [[corrections.joint_table.joint]] a joint with `joint`, `slope`,
/// `backlash_mm`, `hysteresis_mm`, and `at_mm`, `forward_mm`, `backward_mm` (of a rotary joint `_deg`).
/// Errors of a table are actual less commanded.
std::vector<JointTable> read_joint_tables(const Machine& machine, const ConfigTable& section);

}  // namespace trn
