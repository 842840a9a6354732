#pragma once

#include <vector>

#include "core/axes.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/path.h"

// A move at F mm a turn, while the spindle's speed follows the distance of the tip from its axis (G96): in
// parts along which that speed changes little, each with a feed of its own.
namespace trn {

/// Where the parts of a straight move begin, but for the first, as shares of its way, ascending: where the
/// tip's distance from the axis is that at which the greatest speed ends, or a power of the step times it.
/// None where the speed stays.
std::vector<double> speed_steps(const SurfaceSpeed& law, const Words& from, const Words& to);

/// How many even parts an arc needs for that.
int speed_parts(const SurfaceSpeed& law, const PathPiece& arc);

/// The least speed along a path, rpm, without sign.
double least_rpm(const SurfaceSpeed& law, const PathPiece& path);

}  // namespace trn
