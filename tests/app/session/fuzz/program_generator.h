#pragma once

#include <cstdint>
#include <random>
#include <string>
#include <vector>

#include "app/session/assembly.h"
#include "core/axes.h"
#include "core/frames.h"

// Random programs for the judges: what a program from elsewhere may hold, from moves of a nanometre to whole
// strokes, in every path mode and feed mode, with and without RTCP.
namespace trn::fuzz {

/// One line of a program, and what it asks for.
struct Step {
  enum class Kind { kSetting, kTraverse, kFeed, kArc, kDwell, kOther };
  Kind kind = Kind::kSetting;
  std::string text;
  unsigned words = 0;                   ///< bit k: word k of X Y Z A B C is written
  Words value = Words::Zero();          ///< as written: mm, deg
  bool incremental = false;             ///< the words are distances
  double feed = 0;                      ///< kFeed, kArc: mm/min (deg/min if only rotary words are written)
  double time_s = 0;                    ///< what inverse time (G93) or a dwell asks for; 0: neither
  double radius_mm = 0, sweep_rad = 0;  ///< kArc
  int across = kZ;                      ///< kArc: the word across its plane
  bool rtcp_on = false, rtcp_off = false, exact = false;
};

struct Program {
  std::vector<Step> steps;
  bool plain = true;  ///< moves, modes and dwells only: where it ends is the sum of its words
  std::string text() const;
};

/// Makes programs for one machine that stands at `q_start` (mm, rad).
class ProgramGenerator {
 public:
  ProgramGenerator(const Assembly& assembly, const JointVec& q_start, std::uint64_t seed);
  Program make();

  /// True if each word moves one joint by as much: lines are then straight in the joints as well.
  static bool words_are_joints(const Assembly& assembly, const Words& words);

 private:
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(rng_); }
  double log_uniform(double low, double high) { return std::exp(uniform(std::log(low), std::log(high))); }
  int below(int n) { return std::uniform_int_distribution<int>(0, n - 1)(rng_); }
  bool chance(double p) { return uniform(0, 1) < p; }

  void find_ranges();
  double rounded(double value) const;
  std::string number(double value) const;
  double place(int word);

  void add(Step step) { program_.steps.push_back(std::move(step)); }
  void setting(const std::string& text);
  void path_mode();
  void move_to(const Words& target, unsigned words);
  void finish_feed(Step& step, double length_mm, double turn_deg);
  void stroke();
  void rotary_stroke();
  void residual();
  void back();
  void pass();
  void arc();
  void tangent_arcs();
  void put_arc(const Vec3& centre, double sweep_rad, int plane, double along);
  void slow_block();
  void shop_floor();

  const Assembly& assembly_;
  std::mt19937_64 rng_;
  Program program_;
  Words at_ = Words::Zero(), before_ = Words::Zero(), start_ = Words::Zero(), low_ = Words::Zero(),
        high_ = Words::Zero();
  unsigned mask_ = 0;
  bool rtcp_ = false;
  int digits_ = 4;
  double feed_typical_ = 3000;
};

}  // namespace trn::fuzz
