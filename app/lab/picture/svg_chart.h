#pragma once

#include <string>
#include <vector>

namespace trn::picture {

/// A line chart as an SVG file: curves over a common pair of axes with ticks and a legend.
class SvgChart {
 public:
  SvgChart(std::string title, std::string x_label, std::string y_label)
      : title_(std::move(title)), x_label_(std::move(x_label)), y_label_(std::move(y_label)) {}

  /// A y that is not a number breaks the curve.
  void add(const std::string& name, std::vector<double> x, std::vector<double> y);
  /// Same scale on both axes.
  void set_square() { square_ = true; }
  std::string str() const;
  /// OutputError if it cannot be written.
  void write(const std::string& path) const;

 private:
  struct Curve {
    std::string name;
    std::vector<double> x, y;
  };

  std::string title_, x_label_, y_label_;
  std::vector<Curve> curves_;
  bool square_ = false;
};

}  // namespace trn::picture
