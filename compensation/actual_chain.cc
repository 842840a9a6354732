#include "compensation/actual_chain.h"

#include <cmath>

#include "core/config.h"
#include "core/serial_branches.h"

namespace trn {

namespace {

/// Rotation vector -> matrix (Rodrigues).
Mat3 rotation_of(const Vec3& turn) TRN_RT {
  const double angle = turn.norm();
  // Only the division below needs the guard: any other turn, however small, is computed as it is.
  if (angle < 1e-300) return Mat3::Identity();
  const Vec3 w = turn / angle;
  Mat3 W;
  W << 0, -w.z(), w.y(), w.z(), 0, -w.x(), -w.y(), w.x(), 0;
  return Mat3::Identity() + std::sin(angle) * W + (1 - std::cos(angle)) * (W * W);
}

// A becomes A T, where T is the tilt as a matrix.
void tilt(const Vec3& t, TiltModel model, Mat3& A) TRN_RT {
  if (model == TiltModel::kExact) {
    A = (A * rotation_of(t)).eval();
    return;
  }
  // S1.1: products of tilts dropped, as in the paper whose figures the tests hold this form to. It is no
  // rotation but to first order, which is why a pose of this chain is an affine map and is inverted as one.
  const Vec3 x = A.col(0), y = A.col(1), z = A.col(2);
  A.col(0) = x + t.z() * y - t.y() * z;
  A.col(1) = y - t.z() * x + t.x() * z;
  A.col(2) = z + t.y() * x - t.x() * y;
}

// T d, by the same terms in the same order as the columns above.
Vec3 tilted(const Vec3& d, const Vec3& t, TiltModel model) TRN_RT {
  if (t.isZero(0)) return d;
  if (model == TiltModel::kExact) return rotation_of(t) * d;
  return {d.x() - t.z() * d.y() + t.y() * d.z(), t.z() * d.x() + d.y() - t.x() * d.z(),
          t.x() * d.y() - t.y() * d.x() + d.z()};
}

bool is_zero(const SixErrors& e) TRN_RT { return e.offset.isZero(0) && e.tilt.isZero(0); }

void apply(const SixErrors& e, TiltModel model, ActualChain::Affine& X) TRN_RT {
  if (is_zero(e)) return;
  // First the offset in the directions before the tilt, then the tilt: E(e; t) as S1.1 has it. The other
  // order would turn the offset as well.
  X.p += X.A * e.offset;
  if (!e.tilt.isZero(0)) tilt(e.tilt, model, X.A);
}

void apply_linear(const ActualAxis& axis, double q, TiltModel model, ActualChain::Affine& X,
                  ActualChain::JointFrame& frame) TRN_RT {
  X.p += X.A * (axis.location.offset + axis.offset_mm);
  // Squareness turns the direction of motion, not what is carried.
  const Vec3 direction = tilted(axis.direction, axis.location.tilt, model);
  // The Jacobian needs the direction and the place of the joint as they really are, errors before it
  // included.
  frame.axis = X.A * direction;
  frame.place = X.p;
  X.p += q * frame.axis;
  if (!axis.tables.empty()) apply(axis.tables[0].at(q), model, X);
}

void apply_rotary(const ActualAxis& axis, double q, TiltModel model, ActualChain::Affine& X,
                  ActualChain::JointFrame& frame) TRN_RT {
  apply(axis.location, model, X);
  X.p += X.A * axis.offset_mm;
  if (!axis.tables.empty()) apply(axis.tables[0].at(q), model, X);
  frame.axis = X.A * axis.direction;
  frame.place = X.p;
  // A turn by q is never small, so it is a true rotation in both models; only the errors are dropped to first
  // order. Rodrigues' formula with A from the left: A R = cos q A + (1 - cos q) (A w) w' + sin q A [w]x.
  const Vec3& w = axis.direction;
  const double s = std::sin(q), c = std::cos(q);
  const Vec3 bend = (1 - c) * frame.axis;
  const Mat3 A = X.A;
  X.A.col(0) = c * A.col(0) + w.x() * bend + s * (w.z() * A.col(1) - w.y() * A.col(2));
  X.A.col(1) = c * A.col(1) + w.y() * bend + s * (w.x() * A.col(2) - w.z() * A.col(0));
  X.A.col(2) = c * A.col(2) + w.z() * bend + s * (w.y() * A.col(0) - w.x() * A.col(1));
}

void walk(const std::vector<ActualAxis>& branch, bool work, TiltModel model, const JointVec& q,
          ActualChain::Affine& X, ActualChain::Frames& out) TRN_RT {
  for (const ActualAxis& axis : branch) {
    if (axis.joint < 0) {
      X.p += X.A * axis.offset_mm;
      continue;
    }
    auto& frame = out.joint[static_cast<std::size_t>(axis.joint)];
    frame.rotary = axis.kind == JointKind::kRotary;
    frame.in_work_branch = work;
    (frame.rotary ? apply_rotary : apply_linear)(axis, q[axis.joint], model, X, frame);
  }
}

std::vector<ActualAxis> without_errors(const std::vector<BranchAxis>& branch) {
  std::vector<ActualAxis> out;
  for (const BranchAxis& axis : branch)
    out.push_back({axis.joint, axis.kind, axis.direction, axis.offset_mm, {}, {}});
  return out;
}

}  // namespace

SixErrors ErrorTables::at(double q) const TRN_RT {
  SixErrors e;
  for (int i = 0; i < 3; ++i) {
    e.offset[i] = offset[static_cast<std::size_t>(i)].at(q);
    e.tilt[i] = tilt[static_cast<std::size_t>(i)].at(q);
  }
  return e;
}

void ActualChain::evaluate(const JointVec& q, Frames& out) const TRN_RT {
  out.X_MB = out.X_MS = {};
  walk(work, true, model, q, out.X_MB, out);
  walk(tool, false, model, q, out.X_MS, out);
  if (R_MS) out.X_MS.A = (out.X_MS.A * *R_MS).eval();
}

double ActualChain::tilt_bound() const {
  double sum = 0;
  // Tilts add up along a chain at most by their lengths. The tilt of a linear axis' location is left out: it
  // is its squareness, which turns the way of the axis and not what the axis carries.
  for (const auto* branch : {&tool, &work})
    for (const ActualAxis& axis : *branch) {
      if (axis.kind == JointKind::kRotary) sum += axis.location.tilt.norm();
      for (const ErrorTables& t : axis.tables)
        sum += Vec3(t.tilt[0].peak(), t.tilt[1].peak(), t.tilt[2].peak()).norm();
    }
  return sum;
}

ActualChain read_chain(const Machine& machine) {
  const ConfigTable section = machine.root.table("kinematics");
  if (section.text("type") != "serial")
    throw section.error("type", "geometric errors of axes need a machine of type \"serial\"");
  ActualChain chain;
  const SerialBranches branches = read_branches(section, machine.joints);
  chain.tool = without_errors(branches.tool);
  chain.work = without_errors(branches.work);
  if (!branches.R_MS.isIdentity(0)) chain.R_MS = branches.R_MS;
  return chain;
}

ActualAxis* find_axis(ActualChain& chain, int joint) {
  for (auto* branch : {&chain.tool, &chain.work})
    for (ActualAxis& axis : *branch)
      if (axis.joint == joint) return &axis;
  return nullptr;
}

}  // namespace trn
