#pragma once

#include <vector>

#include "interp/plan/geometry/quintic_spline.h"
#include "interp/plan/geometry/run_vertex.h"
#include "interp/plan/geometry/tube_places.h"

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
/// by Newton steps, with m a fixed share of what |y'''|^2 is around. The problem is convex, so what comes out
/// depends on the tube alone, not on the way there. Whoever leaves the tube meets the barrier's parabola; so
/// any start will do, and no narrow place stalls the others: each takes the step that it can.
class TubeFit {
 public:
  /// The coefficients that the fit may change: from .. to - 1.
  struct Free {
    size_t from = 0, to = 0;
  };

  /// The spline must outlive the fit; the samples are located on it.
  TubeFit(QuinticSpline& spline, const std::vector<TubeSample>& samples, Free free);

  /// Follows the target closely.
  void follow();

  /// After follow(): as smooth as the tube allows, at the samples.
  void smooth();

  /// After smooth(): in a narrower tube where the spans' usage exceeds the given one, and `reach` spans
  /// around.
  void draw_in(const std::vector<TubeUse>& usage, double usage_max, size_t reach);

 private:
  /// What |y'''|^2 is made of.
  struct Roughness {
    explicit Roughness(const QuinticSpline& spline);
    std::vector<std::array<double, 4>> third;  ///< the coefficients of y''', of those of y
    std::vector<tube::BandRow> integral;       ///< of |y'''|^2
  };

  /// The position words or the rotary words.
  class Group {
   public:
    Group(QuinticSpline& spline, const std::vector<TubeSample>& samples, const Roughness& roughness,
          Free free, bool rotary);
    void follow();
    void smooth();
    void draw_in(const std::vector<TubeUse>& usage, double usage_max, size_t reach);

   private:
    using Point = tube::Point;
    using Place = tube::Place;
    using Row = tube::BandRow;

    void take_places(const std::vector<TubeSample>& samples);
    bool set_lengths();
    void blur_energy();
    void bound_lengths();
    void set_weights();
    double step();
    bool bound_step();
    double accept_step();
    void aim_inside();
    void solve();
    void factorise();
    void hand_back();

    QuinticSpline& spline_;
    Roughness roughness_;
    Eigen::Index first_word_;
    bool rotary_;
    size_t from_, to_;
    std::vector<Place> places_;
    std::vector<Point> next_off_;                    // by place: after the whole step
    std::vector<Row> band_;                          // symmetric: band_[i][k] = A(i, i + k)
    std::vector<double> inverse_;                    // of D
    std::vector<Point> rhs_, y_, last_;              // coefficients
    std::vector<double> share_;                      // of the step that a coefficient may take
    std::vector<double> span_, length_, weight_;     // by span: itself, the smoothing length l, l^-6
    std::vector<double> radius_, energy_, blurred_;  // by span: least radius, |y'''|^2 of itself and around
  };

  std::vector<Group> groups_;
};

}  // namespace trn
