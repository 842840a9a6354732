#include "app/lab/picture/svg.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace trn::picture {

namespace {

constexpr std::size_t kPointsMax = 4000;  // of a line: two a pixel and more of the widest picture
constexpr double kLetterPerSize = 0.6;    // mean width over size, DejaVu Sans

}  // namespace

double text_width_px(std::string_view words, double size) {
  // A byte that continues a letter of UTF-8 is no letter of its own.
  const auto letters = std::count_if(words.begin(), words.end(), [](char c) { return (c & 0xC0) != 0x80; });
  return kLetterPerSize * size * static_cast<double>(letters);
}

std::string escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '<')
      out += "&lt;";
    else if (c == '&')
      out += "&amp;";
    else
      out += c;
  }
  return out;
}

std::vector<Px> thinned(const std::vector<Px>& points, std::size_t count) {
  if (points.size() <= count) return points;
  const std::size_t per_piece = (2 * points.size() + count - 1) / std::max<std::size_t>(count, 2) + 1;
  std::vector<Px> out;
  for (std::size_t from = 0; from < points.size(); from += per_piece) {
    const std::size_t to = std::min(from + per_piece, points.size());
    std::size_t low = from, high = from;
    for (std::size_t i = from; i < to; ++i) {
      if (std::isnan(points[i].y)) low = high = i;
      if (std::isnan(points[low].y)) continue;  // one gap keeps the whole piece a gap
      if (points[i].y < points[low].y) low = i;
      if (points[i].y > points[high].y) high = i;
    }
    out.push_back(points[std::min(low, high)]);
    if (low != high) out.push_back(points[std::max(low, high)]);
  }
  return out;
}

void Svg::text(double x, double y, std::string_view words, const TextStyle& style) {
  double size = style.size;
  if (style.room_px > 0) size = std::min(size, size * style.room_px / text_width_px(words, size));
  body_ +=
      fmt::format("<text x='{:.1f}' y='{:.1f}' text-anchor='{}' font-size='{:.3g}' fill='{}'{}>{}</text>\n",
                  x, y, style.anchor, size, kInk, style.bold ? " font-weight='bold'" : "", escaped(words));
}

void Svg::line(Px from, Px to, const char* colour, double width) {
  body_ +=
      fmt::format("<path d='M{:.1f},{:.1f}L{:.1f},{:.1f}' fill='none' stroke='{}' stroke-width='{:g}'/>\n",
                  from.x, from.y, to.x, to.y, colour, width);
}

void Svg::fill(const Box& box, std::string_view colour, double opacity) {
  body_ += fmt::format("<rect x='{:.1f}' y='{:.1f}' width='{:.2f}' height='{:.2f}' fill='{}'", box.left,
                       box.top, box.width, box.height, colour);
  body_ += opacity < 1 ? fmt::format(" fill-opacity='{:g}'/>\n", opacity) : "/>\n";
}

void Svg::frame(const Box& box) {
  body_ +=
      fmt::format("<rect x='{:.1f}' y='{:.1f}' width='{:.1f}' height='{:.1f}' fill='none' stroke='{}'/>\n",
                  box.left, box.top, box.width, box.height, kAxis);
}

void Svg::circle(Px centre, double radius, const char* colour, double width) {
  body_ += fmt::format(
      "<circle cx='{:.1f}' cy='{:.1f}' r='{:.1f}' fill='none' stroke='{}' stroke-width='{:g}'/>\n", centre.x,
      centre.y, radius, colour, width);
}

void Svg::dot(Px centre, double radius, const char* colour) {
  body_ += fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='{:g}' fill='{}'/>\n", centre.x, centre.y, radius,
                       colour);
}

void Svg::polyline(const std::vector<Px>& points, std::string_view colour, double width) {
  std::string places;
  const auto finish = [&] {
    if (!places.empty())
      body_ += fmt::format("<polyline points='{}' fill='none' stroke='{}' stroke-width='{:g}'/>\n", places,
                           colour, width);
    places.clear();
  };
  for (const Px& p : thinned(points, kPointsMax)) {
    if (std::isnan(p.y))
      finish();
    else
      places += fmt::format("{:.1f},{:.1f} ", p.x, p.y);
  }
  finish();
}

std::string Svg::str() const {
  return fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0:g} {1:g}' width='{0:g}' height='{1:g}' "
      "font-family='sans-serif'>\n<rect width='{0:g}' height='{1:g}' fill='white'/>\n{2}</svg>\n",
      width_, height_, body_);
}

}  // namespace trn::picture
