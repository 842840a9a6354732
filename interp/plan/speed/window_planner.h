#pragma once

#include "core/axes.h"
#include "core/motion.h"
#include "core/ports.h"
#include "interp/plan/lanes.h"
#include "interp/plan/speed/block_emitter.h"
#include "interp/plan/speed/interior_point.h"
#include "interp/plan/speed/joint_curve.h"
#include "interp/plan/speed/limit_use.h"
#include "interp/plan/speed/path_grid.h"
#include "interp/plan/speed/path_sampler.h"
#include "interp/plan/speed/speed_options.h"
#include "interp/plan/speed/speed_problem.h"
#include "interp/plan/speed/time_law.h"
#include "interp/plan/stages.h"

namespace trn::speed {

/// The work of SpeedPlanner: plans each stretch in windows.
class WindowPlanner {
 public:
  WindowPlanner(const Joints& joints, const JointMap& map, const SpeedOptions& options, BlockSink& out);

  void piece(const PlanPiece& piece);
  void event(const QueueEvent& event, SourceLine source);
  /// Ends the stretch that is open, if any, at the end of its last piece.
  void finish();

  bool failed() const { return failed_; }
  const SpeedStats& stats() const { return stats_; }

 private:
  /// Where the next window begins.
  struct Start {
    bool at_rest = true;
    PathState state;  ///< the true motion
    SpeedState plan;  ///< the solution's
  };
  template <typename Work>
  void or_end_at_rest(Work work);
  void plan(const PlanPiece& piece);
  void part_ends(const PlanPiece& piece);
  void accept(const PlanPiece& piece);
  void advance(bool to_end);
  void plan_window(bool final);
  bool try_window(bool final);
  bool try_shorter(size_t count);
  void adopt();
  size_t segments_within(double time_s) const;
  bool solve_window(size_t head, size_t tail);
  size_t kept_intervals(size_t n) const;
  Doubles estimated_speeds(size_t head, size_t n, size_t keep) const;
  void initial_guess(size_t head, size_t tail);
  void slow_guess(size_t head, size_t tail);
  void damp_undershoot(size_t head);
  bool make_law(size_t head, size_t tail);
  bool verify(int round);
  void lower_speed(size_t interval, const LawSegment& segment, double excess);
  Headroom& lower(size_t interval);
  static void lower_velocity(Headroom& room, double excess, double firmer);
  bool slow_down(size_t head, size_t tail);
  void plan_s_curve();
  void commit(size_t segments, size_t head);
  void drop_intervals(size_t count);
  void emit_rest();
  double law_time() const;

  SpeedOptions options_;
  PathSampler sampler_;
  PathGrid grid_;
  BlockEmitter emitter_;
  InteriorPoint solver_;
  double brake_s_ = 0;          ///< in which the slowest joint stops
  double stretch_brake_s_ = 0;  ///< the same where the program asks for less acceleration
  SpeedStats stats_;

  bool open_ = false;    ///< a stretch has begun and its end is not planned
  bool failed_ = false;  ///< a place could not be planned: all ends at rest before it
  double s_next_ = 0;
  std::vector<double> part_ends_;  ///< of the piece that is cut
  JointCurve curve_;               ///< of the piece that is accepted
  Start start_;
  std::deque<Headroom> headroom_;  ///< per interval of the grid
  std::vector<bool> changed_;      ///< headroom since the problem was set up
  std::vector<LawSegment> law_;    ///< verified, from start_ to rest
  std::vector<LawSegment> candidate_;
  SpeedProblem problem_;
  PlanEnd head_end_, tail_end_;
  Doubles c_, c_before_;  ///< of the window; of the verified plan, from the grid's first interval
  std::vector<SpeedState> nodes_before_;  ///< of the verified plan, at the left ends of c_before_
  int retries_ = 0;                       ///< since the last window that was found
};

}  // namespace trn::speed
