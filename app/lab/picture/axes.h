#pragma once

#include <string>
#include <vector>

#include "app/lab/picture/svg.h"

namespace trn::picture {

/// The least of 1, 2 and 5 times a power of ten that is not below `least`; 1 where `least` is not above 0.
double round_up(double least);

/// Values from low to high that an axis shows.
struct Range {
  double low = 0, high = 1;

  /// The range of all values that are numbers, with `margin` of its width more on either side; never empty.
  static Range over(const std::vector<double>& values, double margin = 0);
};

/// Multiples of a round step inside the range, at most `count` + 1 of them.
std::vector<double> ticks(const Range& range, double count);

/// A number as it stands at a tick.
std::string tick_text(double value);

/// A pair of axes in a part of a picture.
class Axes {
 public:
  Axes(const Box& box, const Range& x, const Range& y) : box_(box), x_(x), y_(y) {}

  Px at(double x, double y) const;
  /// The same scale, in units a pixel, on both: the smaller one gets a wider range about its middle.
  void make_square();
  /// Grid, numbers and frame; the label of y stands above, that of x below. Without `x_label` there are no
  /// numbers along x: another diagram below has them.
  void draw(Svg& svg, const std::string& x_label, const std::string& y_label) const;

  const Box& box() const { return box_; }
  const Range& x() const { return x_; }

 private:
  Box box_;
  Range x_, y_;
};

/// Name and colour of a line, a bar or some dots.
struct LegendEntry {
  std::string name, colour;
};

/// Entries one beside the other from `x` to at most `right`, in as many rows as they need; `y` is the first
/// row's base line. Returns that of the row that would follow.
double draw_legend(Svg& svg, double x, double y, double right, const std::vector<LegendEntry>& entries);

/// Sixteen steps of `shade` as a bar of `width` px with its ends' texts below.
void draw_shades(Svg& svg, Px left_top, double width, const std::string& low, const std::string& high);

}  // namespace trn::picture
