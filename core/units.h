#pragma once

#include <numbers>

// Inside: mm, rad, s, N, A, K. Degrees live in G-code, reports and config keys that say so.
namespace trn {

inline constexpr double kPi = std::numbers::pi;
inline constexpr double kRadPerDeg = kPi / 180.0;
inline constexpr double kDegPerRad = 180.0 / kPi;
inline constexpr double kArcsecPerRad = 3600 * kDegPerRad;
inline constexpr double kMmPerInch = 25.4;

constexpr double rad_from_deg(double angle_deg) { return angle_deg * kRadPerDeg; }
constexpr double deg_from_rad(double angle_rad) { return angle_rad * kDegPerRad; }

}  // namespace trn
