#pragma once

#include <array>
#include <cstddef>
#include <string>

namespace trn::picture {

/// Colours of lines and bars. On white each has a contrast of at least 3 to 1 (WCAG 2.1, 1.4.11). The first
/// six also differ for a reader who cannot tell red from green (after Okabe and Ito, the light ones
/// darkened).
inline constexpr std::array<const char*, 9> kLineColours{
    "#0060a0", "#d55e00", "#008060", "#b0589a", "#806000", "#2b9cd4", "#000000", "#5b4bb5", "#8c2d04"};
inline constexpr const char* kInk = "#222222";   ///< text
inline constexpr const char* kAxis = "#555555";  ///< frames and zero lines
inline constexpr const char* kGrid = "#dddddd";
inline constexpr const char* kNeutral = "#9a9a9a";  ///< what belongs to none of the named things

/// Of the `index`-th line; after the last colour the first comes again.
const char* line_colour(std::size_t index);

/// Colour of a share from 0 to 1 (clamped): dark blue over green to yellow. Its lightness only rises, so that
/// it survives a grey print.
std::string shade(double share);

}  // namespace trn::picture
