#pragma once

#include <cstddef>
#include <limits>
#include <string>
#include <vector>

#include "app/lab/tune/tune_data.h"
#include "core/axes.h"

namespace trn {

/// How a joint is moved for its measurement.
struct TuneWish {
  double length = 0;         ///< mm or rad from where it stands, towards the farther end of its range; 0: a
                             ///< quarter of the range, and no more than its greatest speed needs
  double speed_share = 0.6;  ///< of the joint's velocity, at most
  double cogging_pitch = 0;  ///< mm or rad after which the motor's cogging repeats; 0: it is not looked for
  bool stirs = false;        ///< the motor is shaken meanwhile, to see what swings fast
};

/// All strokes, and what they come to.
struct TunePlan {
  std::vector<TuneStroke> strokes;
  double from = 0, to = 0;  ///< the joint stays between these places, mm or rad
  double speed_max = 0;     ///< per s
  double time_s = 0;        ///< about
  std::size_t first_stirred = std::numeric_limits<std::size_t>::max();  ///< from here on the motor is shaken
  std::size_t first_slow = 0;  ///< strokes from here on are the slow ones, for the play
};

/// Strokes both ways about one side of `stands`: at even speeds for friction and weight, fast ones for the
/// inertia, short ones of many lengths for what swings, creeping ones for the play. std::runtime_error where
/// the joint has no room.
TunePlan plan_tuning(const Joint& joint, double stands, const TuneWish& wish);

/// What will happen, for people.
std::string announcement(const TunePlan& plan, const Joint& joint);

}  // namespace trn
