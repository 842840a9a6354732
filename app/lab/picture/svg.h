#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "app/lab/picture/colours.h"

namespace trn::picture {

/// A place in a picture, px; y grows downwards.
struct Px {
  double x = 0, y = 0;
};

/// A part of a picture, px.
struct Box {
  double left = 0, top = 0, width = 0, height = 0;
  double right() const { return left + width; }
  double bottom() const { return top + height; }
};

struct TextStyle {
  const char* anchor = "start";  ///< of the text at its place: start, middle or end
  double size = 12;              ///< px
  bool bold = false;
  double room_px = 0;  ///< a longer text gets smaller letters; 0: as long as it is
};

/// How long a text is at most, px: sans-serif letters of the widest common font.
double text_width_px(std::string_view words, double size);

/// Places to draw, at most `count` of them: each piece of neighbours keeps its highest and its lowest one, so
/// no peak is lost. Gaps (a y that is not a number) stay.
std::vector<Px> thinned(const std::vector<Px>& points, std::size_t count);

/// An SVG document on white: it needs nothing else, and may stand in a page of HTML.
class Svg {
 public:
  /// Size in px.
  Svg(double width, double height) : width_(width), height_(height) {}

  void text(double x, double y, std::string_view words, const TextStyle& style = {});
  void line(Px from, Px to, const char* colour, double width = 1);
  void fill(const Box& box, std::string_view colour, double opacity = 1);
  void frame(const Box& box);
  void circle(Px centre, double radius, const char* colour, double width = 1);
  void dot(Px centre, double radius, const char* colour);
  /// A place whose y is not a number breaks the line. Of very many places some are left out.
  void polyline(const std::vector<Px>& points, std::string_view colour, double width = 1.4);

  double width() const { return width_; }
  double height() const { return height_; }
  std::string str() const;

 private:
  double width_, height_;
  std::string body_;
};

/// `text` as it may stand in SVG and HTML.
std::string escaped(std::string_view text);

}  // namespace trn::picture
