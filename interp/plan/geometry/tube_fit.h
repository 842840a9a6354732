#pragma once

#include <vector>

#include "core/axes.h"
#include "interp/plan/geometry/quintic_spline.h"
#include "interp/plan/geometry/run_vertex.h"
#include "interp/plan/geometry/tube_samples.h"

namespace trn {

/// One place of the tube that a spline must stay in.
struct TubeSample {
  double u = 0;
  double weight = 0;  ///< length of path that it stands for
  Words middle;       ///< of the tube
  Words target;       ///< in the tube: what the curve is first drawn to
  double radius_mm = 0, radius_rad = 0;
  size_t span = 0;            ///< set by locate_samples
  std::array<double, 6> row;  ///< set by locate_samples: the basis functions of the span at u
};

/// Finds each sample's span and basis functions; samples ascend in u.
void locate_samples(const QuinticSpline& spline, std::vector<TubeSample>& samples);

/// Fits a spline with given knots into a tube, position and rotary words separately: the minimum of
///
///     integral of |y'''|^2 - m log(1 - |y - middle|^2 / radius^2) du      (P3 of docs/planner.md)
///
/// by Newton steps, with m a fixed share of the local mean of |y'''|^2. The problem is convex, so the result
/// depends on the tube alone, not on the iterations. Near the wall and outside of the tube a parabola
/// continues the barrier, so that any start will do. A step is shortened only around the samples that would
/// meet the wall, so that one narrow place does not stall the others.
class TubeFit {
 public:
  /// The coefficients that the fit may change: from .. to - 1.
  struct Free {
    size_t from = 0, to = 0;
  };

  /// The spline must outlive the fit; the samples are located on it.
  TubeFit(QuinticSpline& spline, const std::vector<TubeSample>& samples, Free free);

  /// Follows the target closely: least squares with hardly any smoothing.
  void follow();

  /// After follow(): as smooth as the tube allows, at the samples.
  void smooth();

  /// After smooth(): narrows the tube where the spans' usage exceeds the given one, and `reach` spans around,
  /// and takes a few steps in the narrower tube.
  void tighten(const std::vector<TubeUse>& usage, double usage_max, size_t reach);

 private:
  /// The integral of |y'''|^2 as a quadratic form of the coefficients.
  struct Roughness {
    explicit Roughness(const QuinticSpline& spline);
    std::vector<std::array<double, 4>> third;  ///< the coefficients of y''', of those of y
    std::vector<tube::BandRow> integral;       ///< of |y'''|^2
  };

  /// The fit of one group of words, the position words or the rotary words.
  class Group {
   public:
    Group(QuinticSpline& spline, const std::vector<TubeSample>& samples, const Roughness& roughness,
          Free free, bool rotary);
    void follow();
    void smooth();
    void tighten(const std::vector<TubeUse>& usage, double usage_max, size_t reach);

   private:
    using Point = tube::Point;
    using GroupSample = tube::GroupSample;
    using Row = tube::BandRow;

    void take_samples(const std::vector<TubeSample>& samples);
    bool set_lengths();
    void average_energy();
    void bound_lengths();
    void set_weights();
    double step();
    bool bound_step();
    double accept_step();
    void fit_to_barrier();
    void solve();
    void factorise();
    void write_back();

    QuinticSpline& spline_;
    Roughness roughness_;
    Eigen::Index first_word_;
    bool rotary_;
    size_t from_, to_;
    std::vector<GroupSample> samples_;
    std::vector<Point> next_deviation_;           // by sample: after the whole step
    std::vector<Row> band_;                       // symmetric: band_[i][k] = A(i, i + k)
    std::vector<double> inverse_;                 // of D
    std::vector<Point> rhs_, y_, last_;           // coefficients
    std::vector<double> share_;                   // of the step that a coefficient may take
    std::vector<double> span_, length_, weight_;  // by span: itself, the smoothing length l, l^-6
    std::vector<double> radius_, energy_,
        local_energy_;  // by span: least radius, |y'''|^2 of itself and around
  };

  std::vector<Group> groups_;
};

}  // namespace trn
