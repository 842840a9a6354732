#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <vector>

#include "app/check/programmed_leg.h"
#include "core/frames.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/move.h"

namespace trn {

/// The largest value seen and the source line of its sample.
struct WorstDeviation {
  double value = 0;
  std::uint32_t line = 0;
};

/// Samples by their share of the tolerance, 5 % each; the last bin holds those beyond it.
using DeviationHistogram = std::array<std::uint64_t, 21>;

struct DeviationReport {
  WorstDeviation tip_mm, axis_deg;              ///< over everything
  WorstDeviation tip_ratio, axis_ratio;         ///< to the active tolerance, where there is one
  WorstDeviation tip_exact_mm, axis_exact_deg;  ///< in the exact modes (G61, G61.1)
  /// By how much a deviation is greater than its tolerance (exact modes: than rounding) and what the
  /// machine's corrections leave; 0: nowhere.
  WorstDeviation tip_over_mm, axis_over_deg;
  std::uint64_t samples = 0;
  std::uint64_t lost = 0;  ///< samples so far off that the place on the path had to be found anew
  DeviationHistogram tip_histogram{}, axis_histogram{};  ///< empty unless asked for; no exact modes

  bool broken() const { return tip_over_mm.value > 0 || axis_over_deg.value > 0; }
};

/// Measures how far the motion leaves the programmed path, on the stream of setpoints and apart from the
/// planner.
///
/// Each sample is compared with the programmed places that come next: from the earliest place that the
/// samples so far allow, over a bounded length of path. A path may cross or retrace itself, and the samples
/// near a sharp corner are near both of its legs; the earliest allowed place only moves on when it must. As a
/// sample may be ahead of its place by a tolerance and the next one behind by as much, places so little
/// before count too. The tip's deviation is the distance to the nearest of these places; the axis' deviation
/// is the smallest angle among those whose tip is within the active tolerance, plus rounding. Moves of
/// another context (tool, work offset, RTCP) are looked at when a sample of theirs has come. Where the
/// program jumps without motion in one context, the search goes on behind the jump once a sample has stood at
/// its foot.
///
/// Moves that no sample can meet any more are dropped: memory is bounded by how far the moves run ahead.
class DeviationMeter {
 public:
  /// `histograms`: look for the best place of every sample, which takes longer.
  explicit DeviationMeter(const Kinematics& kinematics, bool histograms = false)
      : kinematics_(kinematics), histograms_(histograms) {}

  /// The next move, in program order; given before the first sample of its motion.
  void programmed(const ProgramMove& move);

  /// The machine stands, and what was programmed so far is over: a probe move ended on the way.
  void restart() {
    legs_.clear();
    here_ = 0;
    share_ = 0;
  }

  /// What the machine's corrections leave of its errors in a sample, mm and deg: no fault of the motion.
  struct Left {
    double tip_mm = 0, axis_deg = 0;
  };

  /// The samples that follow belong to moves of this context.
  void enter(const MapContext& context);

  /// The next sample: p the tip in the frame of the moves' X Y Z words (mm), u the tool axis there (unit),
  /// and the source line it belongs to.
  void sample(const Vec3& p, const Vec3& u, std::uint32_t line, const Left& left);
  void sample(const Vec3& p, const Vec3& u, std::uint32_t line) { sample(p, u, line, Left()); }

  const DeviationReport& report() const { return report_; }
  /// The tip's deviation in the last sample; with `histograms` the least that any allowed place has.
  double tip_mm() const { return tip_mm_; }
  std::size_t held_moves() const { return legs_.size() - here_; }

 private:
  struct Entry {
    ProgrammedLeg leg;
    MapContext context = {};
    bool new_context = false;  // another one than that of the entry before
    bool jump_before = false;  // the programmed tip does not come from the end of the entry before
    bool end_reached = false;  // a sample has stood at its end
  };
  struct Candidate {
    std::size_t entry = 0;
    double share = 0;  // the earliest one this candidate stands for
    double tip_mm = 0, tip_ratio = 0, axis_deg = 0, axis_ratio = 0;
    double tip_off = 0, axis_off = 0;  // ratios to what is allowed and what the corrections leave
    double allowed_mm = 0, allowed_deg = 0;
    bool tip_exact = false, axis_exact = false, tip_fits = false;
  };

  struct Window {
    double tip_mm = 0, axis_deg = 0;
  };

  struct Place {
    std::size_t entry = 0;
    double share = 0;
  };

  void search(const Vec3& p, const Vec3& u, Window left);
  void search_behind(const Vec3& p, const Vec3& u, Window left);
  Place behind(Window left) const;
  void search_entry(std::size_t index, const Vec3& p, const Vec3& u, double from, double to);
  Candidate judge(std::size_t index, const LegPlace& place, const Vec3& p, const Vec3& u, double from,
                  double to) const;
  bool settled(const Candidate& candidate) const;
  void note_end(std::size_t index, const Vec3& p, const Vec3& u);
  void record(std::uint32_t line, const Left& left);
  void advance();
  double earliest_share(const ProgrammedLeg& leg, const Candidate& found, double begin, double end,
                        const Vec3& u) const;
  Window tolerance_ahead() const;
  void note_excess(const Candidate& tip, const Candidate& axis, const Left& left, std::uint32_t line);
  void find_anew(const Vec3& p, const Vec3& u);
  void drop_behind();

  const Kinematics& kinematics_;
  bool histograms_;
  std::deque<Entry> legs_;
  std::size_t here_ = 0;  // the earliest allowed place is on this leg,
  double share_ = 0;      // at this share of it
  Vec3 p_last_ = Vec3::Zero(), u_last_ = Vec3::UnitZ();
  double tip_mm_ = 0;
  bool sampled_ = false, settled_ = false;
  Left left_;  // by the corrections, in this sample
  std::vector<LegPlace> places_;
  std::vector<Candidate> candidates_;
  DeviationReport report_;
};

}  // namespace trn
