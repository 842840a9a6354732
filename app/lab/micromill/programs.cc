#include "app/lab/micromill/programs.h"

#include <fmt/format.h>

#include <cmath>

namespace trn {

namespace {

/// Writes lines and remembers those that count.
class Writer {
 public:
  Writer() { line("G21 G90 G17 G64 P0.002"); }
  template <typename... Args>
  void line(fmt::format_string<Args...> format, Args&&... args) {
    program_.text += fmt::format(format, std::forward<Args>(args)...) + "\n";
    ++count_;
  }
  void last_counts() { program_.lines.push_back(count_); }
  LabProgram finish() {
    line("M2");
    return program_;
  }

  /// One turn clockwise about the origin.
  void circle(double radius_mm, double feed_mm_s) {
    line("G0 X{:.4f} Y0", -radius_mm);
    line("G2 X{:.4f} Y0 I{:.4f} J0 F{:.3f}", -radius_mm, radius_mm, 60 * feed_mm_s);
    last_counts();
  }
  void ramp(double x_mm, double y_mm, double feed_mm_s) {
    line("G1 X{:.4f} Y{:.4f} F{:.3f}", x_mm, y_mm, 60 * feed_mm_s);
    last_counts();
  }

 private:
  LabProgram program_;
  std::uint32_t count_ = 0;
};

constexpr double kFeed = 60 * 4.8;  // mm/min: 8 um a tooth at 18000 rpm
constexpr double kDepth = 0.3;      // through the plate
constexpr double kLeadIn = 1.5;

void round_contour(Writer& out) {
  const double r = kPartSizeMm / 2 + kToolRadiusMm;
  out.line("G0 X{:.4f} Y{:.4f} Z1", -r - kLeadIn, -kLeadIn);
  out.line("M3 S18000");
  out.line("G1 Z{:.3f} F60", -kDepth);
  out.line("G3 X{:.4f} Y0 I0 J{:.4f} F{:.3f}", -r, kLeadIn, kFeed);
  out.line("G2 X{:.4f} Y0 I{:.4f} J0", -r, r);
  out.last_counts();
  out.line("G3 X{:.4f} Y{:.4f} I{:.4f} J0", -r - kLeadIn, kLeadIn, -kLeadIn);
}

void square_contour(Writer& out) {
  const double a = kPartSizeMm / 2, r = kToolRadiusMm, b = a + r;
  out.line("G0 X{:.4f} Y{:.4f} Z1", -b - kLeadIn, -a - kLeadIn);
  out.line("M3 S18000");
  out.line("G1 Z{:.3f} F60", -kDepth);
  out.line("G3 X{:.4f} Y{:.4f} I0 J{:.4f} F{:.3f}", -b, -a, kLeadIn, kFeed);
  const double x[] = {-b, a, b, -a}, y[] = {a, b, -a, -b};    // ends of the sides
  const double nx[] = {-a, b, a, -b}, ny[] = {b, a, -b, -a};  // ends of the corners
  const double i[] = {r, 0, -r, 0}, j[] = {0, -r, 0, r};
  for (int side = 0; side < 4; ++side) {
    out.line("G1 X{:.4f} Y{:.4f}", x[side], y[side]);
    out.last_counts();
    if (side < 3) out.line("G2 X{:.4f} Y{:.4f} I{:.4f} J{:.4f}", nx[side], ny[side], i[side], j[side]);
  }
  out.line("G1 X{:.4f} Y{:.4f}", -b - kLeadIn, -b);
}

}  // namespace

LabProgram sine_program() {
  Writer out;
  out.line("G0 Z5");
  const double radius[] = {26, 22, 18, 15, 12.8, 12.8, 9, 5, 25};
  const double feed[] = {6, 12, 4, 5, 4.8, 7, 4, 3, 16};
  for (int i = 0; i < 9; ++i) out.circle(radius[i], feed[i]);
  return out.finish();
}

LabProgram validation_program() {
  Writer out;
  out.line("G0 Z5");
  out.circle(24, 8);
  out.circle(16, 5);
  out.circle(7, 3.5);
  out.line("G0 X-20 Y-24");
  out.ramp(20, 24, 5);
  out.ramp(-20, -24, 7);
  return out.finish();
}

LabProgram pressing_program(int axis, double block_mm, double depth_mm) {
  const char letter = axis == 0 ? 'X' : 'Y';
  Writer out;
  out.line("G0 Z5");
  out.line("G0 {}{:.4f}", letter, block_mm - 2);
  out.line("G1 {}{:.4f} F60", letter, block_mm - 0.05);
  out.line("G1 {}{:.4f} F6", letter, block_mm + depth_mm);
  out.last_counts();
  out.line("G1 {}{:.4f} F60", letter, block_mm - 2);
  return out.finish();
}

LabProgram part_program(PartSurface::Shape shape) {
  Writer out;
  shape == PartSurface::Shape::kRound ? round_contour(out) : square_contour(out);
  out.line("G1 Z5 F600");
  out.line("M5");
  return out.finish();
}

}  // namespace trn
