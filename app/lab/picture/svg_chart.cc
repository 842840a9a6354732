#include "app/lab/picture/svg_chart.h"

#include "app/lab/picture/axes.h"
#include "app/lab/picture/svg.h"
#include "app/lab/text_file.h"

namespace trn::picture {

namespace {

constexpr double kWidth = 900, kLeft = 80, kRight = 30, kPlot = 450;

}  // namespace

void SvgChart::add(const std::string& name, std::vector<double> x, std::vector<double> y) {
  curves_.push_back({name, std::move(x), std::move(y)});
}

std::string SvgChart::str() const {
  std::vector<double> all_x, all_y;
  std::vector<LegendEntry> legend;
  for (const Curve& curve : curves_) {
    all_x.insert(all_x.end(), curve.x.begin(), curve.x.end());
    all_y.insert(all_y.end(), curve.y.begin(), curve.y.end());
    legend.push_back({curve.name, line_colour(legend.size())});
  }
  constexpr double kTop = 90;
  const double plot = square_ ? kWidth - kLeft - kRight : kPlot;
  Svg svg(kWidth, kTop + plot + 50);
  svg.text(kLeft, 28, title_, {"start", 17, false, kWidth - kLeft - kRight});
  draw_legend(svg, kLeft, 54, kWidth - kRight, legend);
  Axes axes({kLeft, kTop, kWidth - kLeft - kRight, plot}, Range::over(all_x, square_ ? 0.05 : 0),
            Range::over(all_y, 0.05));
  if (square_) axes.make_square();
  axes.draw(svg, x_label_, y_label_);
  for (std::size_t i = 0; i < curves_.size(); ++i) {
    std::vector<Px> points;
    for (std::size_t k = 0; k < curves_[i].x.size(); ++k)
      points.push_back(axes.at(curves_[i].x[k], curves_[i].y[k]));
    svg.polyline(points, line_colour(i));
  }
  return svg.str();
}

void SvgChart::write(const std::string& path) const { write_text_file(path, str()); }

}  // namespace trn::picture
