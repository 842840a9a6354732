#include "interp/plan/speed/joint_curve.h"

#include <algorithm>
#include <cmath>

#include "core/axes.h"
#include "core/units.h"

namespace trn::speed {

namespace {

constexpr int kNodes = JointPanel::kNodes;
constexpr double kInner = 0.8;  // of the range that is interpolated, the part that is used
// Greatest second and third derivatives of the Chebyshev polynomials of degree 0 to kNodes on |x| <= kInner.
constexpr double kD2Max[kNodes + 1] = {0, 0, 4, 19.2, 45.4, 67.8, 60.6, 85.7, 138.7, 214.3, 269};
constexpr double kD3Max[kNodes + 1] = {0, 0, 0, 24, 153.6, 494.4, 1044.5, 1540.2, 1436.2, 1882.5, 3364};
// The same of the fifth and sixth.
constexpr double kD5Max[kNodes] = {0, 0, 0, 0, 0, 1920, 18432, 89780, 292946, 708314};
constexpr double kD6Max[kNodes] = {0, 0, 0, 0, 0, 0, 23040, 258048, 1467190, 5604800};
constexpr double kRounding = 5e-16;     // of a joint's value: coefficients below are rounding
constexpr double kAllRounding = 2e-15;  // of the largest joint's value: rounding of the map's own arithmetic

using Square = std::array<std::array<double, kNodes>, kNodes>;

/// Matrices of the interpolation: values at the nodes to Chebyshev coefficients, these to powers of x.
struct Basis {
  std::array<double, kNodes> node;
  Square chebyshev{}, power{};

  Basis() {
    for (size_t i = 0; i < kNodes; ++i) {
      const double angle = kPi * (static_cast<double>(i) + 0.5) / kNodes;
      node[i] = std::cos(angle);
      for (size_t k = 0; k < kNodes; ++k)
        chebyshev[k][i] = (k == 0 ? 1.0 : 2.0) / kNodes * std::cos(static_cast<double>(k) * angle);
    }
    power[0][0] = power[1][1] = 1;  // T_k+1 = 2 x T_k - T_k-1
    for (size_t k = 2; k < kNodes; ++k)
      for (size_t m = 0; m <= k; ++m) power[k][m] = (m > 0 ? 2 * power[k - 1][m - 1] : 0) - power[k - 2][m];
  }
};

// Copies to the first eight joints, or to the rest. Sizes are constants, so that no call of memcpy is left.
TRN_VECTOR_INLINE void put_part(const Eight& from, size_t part, PerJoint& to) {
  static_assert(kMaxJoints >= 8 && kMaxJoints <= 16);
  if (part == 0)
    std::memcpy(to.data(), &from, sizeof from);
  else
    std::memcpy(to.data() + 8, &from, (kMaxJoints - 8) * sizeof(double));
}

const Basis& basis() {
  static const Basis basis;
  return basis;
}

}  // namespace

// The nodes of the Chebyshev polynomial of degree kNodes, on a range 1 / kInner as long as the panel:
// derivatives of the interpolation are accurate inside the range and poor towards its ends.
bool JointPanel::interpolate(const JointMap& map, const PlanPiece& piece, double s0, double s1) {
  s0_ = s0;
  s1_ = s1;
  middle_ = (s0 + s1) / 2;
  const double half = (s1 - s0) / 2 / kInner;
  inverse_ = 1 / half;
  std::array<JointVec, kNodes> q;
  for (size_t i = 0; i < kNodes; ++i)
    if (map.map(piece.piece.at(middle_ + half * basis().node[i]), piece.context, q[i]) != KinStatus::kOk)
      return false;
  count_ = static_cast<int>(q[0].size());
  double size = 0;
  for (const JointVec& at : q) size = std::max(size, at.cwiseAbs().maxCoeff());
  rounding_ = true;
  terms_ = 1;
  for (int j = 0; j < count_; ++j) {
    std::array<double, kNodes> values;
    for (size_t i = 0; i < kNodes; ++i) values[i] = q[i][j];
    set_joint(j, values, kAllRounding * size);
  }
  return true;
}

// Chebyshev coefficients of one joint, then powers of x. Trailing coefficients that rounding hides are
// dropped, as third derivatives would blow them up. The bounds follow from the greatest derivatives of the
// Chebyshev polynomials.
void JointPanel::set_joint(int joint, const std::array<double, kNodes>& values, double rounding) {
  const double origin = values[0];  // taken off, so that a joint at rest has no coefficients at all
  std::array<double, kNodes> c{}, powers{};
  double size = std::abs(origin);
  for (size_t i = 0; i < kNodes; ++i) {
    const double value = values[i] - origin;
    size = std::max(size, std::abs(values[i]));
    for (size_t k = 0; k < kNodes; ++k) c[k] += basis().chebyshev[k][i] * value;
  }
  const double hidden = kRounding * size;
  size_t kept = kNodes;
  while (kept > 1 && std::abs(c[kept - 1]) <= hidden) --kept;
  for (size_t k = 0; k < kept; ++k)
    for (size_t m = k % 2; m <= k; m += 2) powers[m] += basis().power[k][m] * c[k];
  powers[0] += origin;
  double omitted = kept > 1 ? hidden : 0;
  if (kept == kNodes) omitted = std::max(std::abs(c[kNodes - 1]), 0.2 * std::abs(c[kNodes - 2]));
  if (omitted > std::max(hidden, rounding)) rounding_ = false;
  const auto at = static_cast<size_t>(joint);
  double d5_max = 0, d6_max = 0;
  for (size_t k = 5; k < kept; ++k) {
    d5_max += kD5Max[k] * std::abs(c[k]);
    d6_max += kD6Max[k] * std::abs(c[k]);
  }
  const double inverse_2 = inverse_ * inverse_, inverse_5 = inverse_2 * inverse_2 * inverse_;
  d5_max_[at] = d5_max * inverse_5;
  d6_max_[at] = d6_max * inverse_5 * inverse_;
  terms_ = std::max(terms_, kept);
  error2_[at] = omitted * kD2Max[kept] * inverse_ * inverse_;
  error3_[at] = omitted * kD3Max[kept] * inverse_ * inverse_ * inverse_;
  for (size_t m = 0; m < kNodes; ++m) power_[at / 8][m][at % 8] = powers[m];
}

TRN_VECTOR_CLONES void JointPanel::at(double s, JointDerivatives& out) const {
  const double x = (s - middle_) * inverse_;
  const double by2 = 2 * inverse_ * inverse_, by3 = 6 * inverse_ * inverse_ * inverse_;
  for (size_t part = 0; part * 8 < static_cast<size_t>(count_); ++part) {
    const Eight* const c = power_[part];
    Eight q = c[terms_ - 1], d1{}, d2{}, d3{};
    for (size_t k = terms_ - 1; k-- > 0;) {  // Horner on value and derivatives; d_n holds d^n / n!
      d3 = d3 * x + d2;
      d2 = d2 * x + d1;
      d1 = d1 * x + q;
      q = q * x + c[k];
    }
    d1 *= inverse_;
    d2 *= by2;
    d3 *= by3;
    put_part(q, part, out.q);
    put_part(d1, part, out.d1);
    put_part(d2, part, out.d2);
    put_part(d3, part, out.d3);
  }
}

const JointPanel* panel_at(const JointCurve& curve, double s) {
  for (const JointPanel& panel : curve)
    if (s >= panel.s0() && s <= panel.s1()) return &panel;
  return nullptr;
}

}  // namespace trn::speed
