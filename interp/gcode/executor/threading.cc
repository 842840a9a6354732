#include <fmt/format.h>

#include <cmath>

#include "core/check.h"
#include "core/units.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/settings.h"
#include "interp/gcode/text/block.h"

// G33, G33.1 and the threading cycle G76 (LinuxCNC's G code reference): motion geared to the spindle.
namespace trn {

namespace {

constexpr double kPassesMax = 10000;
constexpr int kEntryTaper = 1, kExitTaper = 2;  // bits of L

}  // namespace

/// One G76, in program units; X runs towards the full depth, Z towards the end.
struct Executor::Thread {
  double x, z, z_end;  ///< drive line and start, end of the thread
  double peak;         ///< I: drive line to thread peak, signed
  double depth;        ///< K: full depth
  double pitch, slope, taper;
  bool entry, exit;
  double into() const { return peak < 0 ? -1 : 1; }
  double along() const { return z_end > z ? 1 : -1; }
  double taper_pitch() const { return pitch * std::hypot(taper, depth) / taper; }
};

// G33 and G33.1: a straight move geared to the spindle, K units a turn.
void Executor::spindle_synchronous(const Block& b, GCode motion) {
  const std::uint32_t column = b.motion_column();
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, g_name(motion));
  if (s_.modal.turn == SpindleTurn::kStopped) fail(GcodeErrorCode::kNoSpindle, column, g_name(motion));
  const ProgramWords to = target(b);
  put(canon::StartFeedSync{b['K'], false, motion != 33_g});
  if (motion == 33_g) {
    put(canon::StraightFeed{to, 0});
    s_.position = to;
  } else {
    put(canon::RigidTap{to});
  }
  put(PlainCanon::kStopFeedSync);
}

Executor::Thread Executor::thread_of(const Block& b) const {
  for (const char letter : {'A', 'B', 'C'})
    if (b.has(letter)) fail(GcodeErrorCode::kCycle, b.at(letter), "G76 moves no rotary axis", "X Y Z");
  const auto value = [&](char letter, bool good, std::string_view legal) {
    if (!good) fail(GcodeErrorCode::kBadValue, b.at(letter), letter, b[letter], "G76", legal);
  };
  value('P', b['P'] >= 0, "a pitch greater than 0");
  value('I', b['I'] != 0, "the way from drive line to thread peak, not 0");
  value('J', b['J'] > 0, "a first depth greater than 0");
  value('K', b['K'] > b['J'], "a full depth greater than the first, J");
  const double l = b.get('L', 0), h = b.get('H', 0);
  value('L', l == std::round(l) && l >= 0, "0 to 3: no taper, at the entry, at the exit, at both");
  value('H', h == std::round(h) && h < kPassesMax, "a whole number of spring passes");
  value('Q', std::abs(b.get('Q', 0)) < 90, "an angle of less than 90 degrees");
  // In G7 the words along X are diameters, while the passes are reckoned in radii.
  const double scale = s_.modal.diameter ? 0.5 : 1;
  const int ends = static_cast<int>(std::min(l, 1e6));
  const double taper = b.get('E', 0);
  return {s_.position[kX],
          s_.position[kZ],
          target(b)[kZ],
          scale * b['I'],
          scale * b['K'],
          b['P'],
          std::tan(rad_from_deg(b.get('Q', 0))),
          taper,
          taper != 0 && (ends & kEntryTaper) != 0,
          taper != 0 && (ends & kExitTaper) != 0};
}

// Depths grow with the R-th root of the pass' number, so that R of 2 takes away the same area in each.
void Executor::threading_cycle(const Block& b) {
  const std::uint32_t column = b.motion_column();
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, "G76");
  if (s_.modal.turn == SpindleTurn::kStopped) fail(GcodeErrorCode::kNoSpindle, column, "G76");
  const Thread thread = thread_of(b);
  const ProgramWords end = target(b);
  const double first = (s_.modal.diameter ? 0.5 : 1) * b['J'];
  const double power = 1 / std::max(1.0, b.get('R', 1));
  TRN_CHECK(first > 0 && first < thread.depth);
  // Depth of pass n is first * n^power, so the number of passes follows before the first is made. A first
  // depth of a nanometre would make millions.
  if (std::pow(thread.depth / first, 1 / power) > kPassesMax)
    fail(GcodeErrorCode::kBadValue, b.at('J'), 'J', b['J'], "G76",
         fmt::format("a first depth that needs at most {} passes", kPassesMax));
  for (int pass = 1;; ++pass) {
    const double depth = first * std::pow(pass, power);
    if (depth >= thread.depth) break;
    thread_pass(thread, depth);
  }
  for (int pass = 0; pass <= static_cast<int>(b.get('H', 0)) || pass == 0; ++pass)
    thread_pass(thread, thread.depth);
  put(canon::StraightTraverse{end});
  s_.position = end;
}

// In at the flank's angle, along the thread, out again.
void Executor::thread_pass(const Thread& thread, double depth) {
  TRN_CHECK(depth > 0 && depth <= thread.depth);
  TRN_CHECK(!(thread.entry || thread.exit) || thread.taper != 0);
  ProgramWords at = s_.position;
  const auto traverse = [&] { put(canon::StraightTraverse{at}); };
  const auto feed = [&] { put(canon::StraightFeed{at, 0}); };
  // A shallow pass begins further out by what it does not cut, so every pass has the same way in.
  const double clear = thread.x - thread.into() * (thread.depth - depth);
  const double cut = thread.x + thread.peak + thread.into() * depth;
  const double end = thread.z_end - thread.along() * (thread.depth - depth) * thread.slope;
  at[kX] = clear;
  // The flank's angle: a deeper pass begins further on, so that the insert cuts with one flank only.
  at[kZ] = thread.z + thread.along() * depth * thread.slope;
  traverse();
  if (!thread.entry) {
    at[kX] = cut;
    traverse();
  }
  // An override would change the way a turn and spoil the pitch. Behind the pass the program's own word
  // counts.
  const bool feed_override = s_.modal.feed_override;
  put(PlainCanon::kDisableFeedOverride);
  if (thread.entry) {
    put(canon::StartFeedSync{thread.taper_pitch(), false});
    at[kX] = clear + thread.peak;
    feed();
    at[kX] = cut;
    at[kZ] += thread.along() * thread.taper;
    feed();
  }
  put(canon::StartFeedSync{thread.pitch, false});
  at[kZ] = thread.exit ? end - thread.along() * thread.taper : end;
  feed();
  if (thread.exit) {
    put(canon::StartFeedSync{thread.taper_pitch(), false});
    at[kX] = cut - thread.into() * thread.depth;
    at[kZ] = end;
    feed();
  }
  put(PlainCanon::kStopFeedSync);
  at[kX] = clear;
  traverse();
  if (feed_override) put(PlainCanon::kEnableFeedOverride);
}

}  // namespace trn
