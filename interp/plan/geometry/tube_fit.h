#pragma once

#include <vector>

#include "interp/plan/geometry/quintic_spline.h"
#include "interp/plan/geometry/run_vertex.h"

namespace trn {

/// One place of the tube that a spline must stay in.
struct TubeSample {
  double u = 0;
  double weight = 0;  ///< length of path that it stands for
  Words y;            ///< middle of the tube
  Words target;       ///< in the tube: what the curve is drawn to
  double radius_mm = 0, radius_rad = 0;
  size_t span = 0;            ///< set by locate_samples
  std::array<double, 6> row;  ///< set by locate_samples: the basis functions of the span at u
};

/// Finds each sample's span and basis functions; samples ascend in u.
void locate_samples(const QuinticSpline& spline, std::vector<TubeSample>& samples);

/// Fits a spline with given knots into a tube, position and rotary words separately.
///
/// A smoothing spline minimises the integral of |y'''|^2 + (|y - target| / l^3)^2: it is smooth over the
/// length l. Where the tube is wide against what the path does, l may be long; the fit looks, span by span,
/// for the longest l that leaves the deviation just inside the tube. Deviation grows with l (with l itself at
/// a corner, with its sixth power on a smooth curve), so this is a root to be found, by a damped iteration.
class TubeFit {
 public:
  /// The coefficients that the fit may change: from .. to - 1.
  struct Free {
    size_t from = 0, to = 0;
  };

  /// Both must outlive the fit; the samples are located on the spline.
  TubeFit(QuinticSpline& spline, const std::vector<TubeSample>& samples, Free free);

  /// Follows the target closely.
  void follow();

  /// After follow(): as smooth as the tube allows, at the samples.
  void smooth();

  /// After smooth(): a bit less smooth where the spans' usage exceeds the given one, and `reach` spans
  /// around.
  void draw_in(const std::vector<TubeUse>& usage, double usage_max, size_t reach);

 private:
  class Group {
   public:
    Group(QuinticSpline& spline, const std::vector<TubeSample>& samples, Free free, bool rotary);
    void follow();
    void smooth();
    void draw_in(const std::vector<TubeUse>& usage, double usage_max, size_t reach);

   private:
    using Row = std::array<double, 6>;

    void add_penalty();
    void bound_lengths();
    void assemble();
    void factorise();
    void solve();
    double measure();
    void hand_back();

    QuinticSpline& spline_;
    const std::vector<TubeSample>& samples_;
    Eigen::Index first_word_;
    bool rotary_;
    size_t from_, to_;
    std::vector<Row> penalty_;  // symmetric: penalty_[i][k] = A(i, i + k)
    std::vector<Row> band_;
    std::vector<double> inverse_;  // of D
    std::vector<Vec3> rhs_, y_;
    std::vector<double> span_, length_, usage_;  // by span: itself, the smoothing length, what it uses
  };

  std::vector<Group> groups_;
};

}  // namespace trn
