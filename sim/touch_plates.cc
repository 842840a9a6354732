#include "sim/touch_plates.h"

#include "compensation/rtcp.h"

namespace trn {

TouchPlates::TouchPlates(const std::vector<Plate>& plates, const Kinematics& kinematics)
    : plates_(plates), kinematics_(kinematics), X_MB_(inverse(kinematics.home_X_BM())) {}

bool TouchPlates::touches(const JointVec& q, const Vec3& tool_offset) const TRN_RT {
  if (plates_.empty()) return false;
  Pose X_BS;
  // Joints that no pose belongs to touch nothing.
  if (kinematics_.forward(q, X_BS) != KinStatus::kOk) return false;
  // Plates lie in machine coordinates, as the program sees them with every offset at zero, also when the
  // table carries the work.
  const Vec3 p = X_MB_ * tip_from_spindle(X_BS, tool_offset);
  for (const Plate& plate : plates_)
    if ((p - plate.min_mm).minCoeff() >= 0 && (plate.max_mm - p).minCoeff() >= 0) return true;
  return false;
}

std::vector<TouchPlates::Plate> read_plates(const ConfigTable& table) {
  std::vector<TouchPlates::Plate> plates;
  for (const ConfigTable& entry : table.tables_if("plate")) {
    const TouchPlates::Plate plate{entry.vec3("min_mm"), entry.vec3("max_mm")};
    if ((plate.max_mm - plate.min_mm).minCoeff() <= 0)
      throw entry.error("max_mm", "every coordinate must be greater than that of min_mm");
    plates.push_back(plate);
  }
  return plates;
}

}  // namespace trn
