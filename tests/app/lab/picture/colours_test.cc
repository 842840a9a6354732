#include "app/lab/picture/colours.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <string>

// Contrast by WCAG 2.1; colours as a reader without green receptors sees them by the matrix of Machado,
// Oliveira and Fernandes (2009), distances in CIE L*a*b*.
namespace trn::picture {
namespace {

using Colour = Eigen::Vector3d;

/// Red, green and blue from 0 to 1, light and no longer the screen's curve.
Colour linear(const std::string& hex) {
  Colour out;
  for (int k = 0; k < 3; ++k) {
    const double c = std::stoi(hex.substr(static_cast<std::size_t>(1 + 2 * k), 2), nullptr, 16) / 255.0;
    out[k] = c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
  }
  return out;
}

double luminance(const Colour& c) { return Colour(0.2126, 0.7152, 0.0722).dot(c); }
double contrast_on_white(const char* hex) { return 1.05 / (luminance(linear(hex)) + 0.05); }

Colour lab(const Colour& rgb) {
  Eigen::Matrix3d to_xyz;
  to_xyz << 0.4124, 0.3576, 0.1805, 0.2126, 0.7152, 0.0722, 0.0193, 0.1192, 0.9505;
  const Colour xyz = (to_xyz * rgb).cwiseQuotient(Colour(0.9505, 1, 1.089));
  const Colour f =
      xyz.unaryExpr([](double t) { return t > 0.008856 ? std::cbrt(t) : 7.787 * t + 16.0 / 116; });
  return {116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])};
}

Colour without_green_receptors(const Colour& rgb) {
  Eigen::Matrix3d m;
  m << 0.367322, 0.860646, -0.227968, 0.280085, 0.672501, 0.047413, -0.011820, 0.042940, 0.968881;
  return (m * rgb).cwiseMax(0).cwiseMin(1);
}

TEST(Colours, OfLinesAndTextStandOutOnWhite) {
  for (const char* colour : kLineColours) EXPECT_GE(contrast_on_white(colour), 3) << colour;
  EXPECT_GE(contrast_on_white(kInk), 7);
  EXPECT_GE(contrast_on_white(kAxis), 3);
}

TEST(Colours, TheFirstSixDifferForEveryReader) {
  double least = 1e9;
  for (std::size_t i = 0; i < 6; ++i)
    for (std::size_t k = 0; k < i; ++k) {
      const Colour a = linear(kLineColours[i]), b = linear(kLineColours[k]);
      EXPECT_GT((lab(a) - lab(b)).norm(), 20) << kLineColours[i] << " " << kLineColours[k];
      const double blind = (lab(without_green_receptors(a)) - lab(without_green_receptors(b))).norm();
      EXPECT_GT(blind, 10) << kLineColours[i] << " " << kLineColours[k];
      least = std::min(least, blind);
    }
  std::printf("least distance without green receptors: %.1f\n", least);
}

TEST(Colours, ShadesOnlyGetLighter) {
  double before = -1;
  for (int i = 0; i <= 32; ++i) {
    const double now = luminance(linear(shade(i / 32.0)));
    EXPECT_GT(now, before);
    before = now;
  }
  EXPECT_EQ(shade(-1), shade(0));
  EXPECT_EQ(shade(2), shade(1));
}

TEST(Colours, BeginAnewBehindTheLast) {
  EXPECT_STREQ(line_colour(0), line_colour(kLineColours.size()));
  EXPECT_STRNE(line_colour(0), line_colour(1));
}

}  // namespace
}  // namespace trn::picture
