#pragma once

#include "interp/plan/speed/block_emitter.h"
#include "interp/plan/speed/interior_point.h"
#include "interp/plan/speed/limit_use.h"

namespace trn {

/// How the speed stage works; constant.
struct SpeedOptions {
  double acceleration_share =
      0.99;  ///< of the joints' limits; the rest lets override and hold act in the tick
  double jerk_share = 0.98;
  double window_s = 0;        ///< motion planned at once; 0: from the joints' limits
  double node_spacing_s = 0;  ///< of the grid, in estimated time; 0: from the joints' limits
  size_t buffered_pieces_max = 20000;
};

/// What the stage did.
struct SpeedStats {
  std::uint64_t pieces = 0, blocks = 0, intervals = 0, windows = 0, iterations = 0, rounds = 0;
  std::uint64_t slowed = 0;     ///< windows from rest that had to be slowed down as a whole
  std::uint64_t fallbacks = 0;  ///< stops inside a stretch because a window found no better plan
  double time_s = 0;            ///< of the motion emitted
};

/// The speed stage: finds the time law of every stretch under the limits of the motor joints and the feed,
/// and emits blocks whose law is piecewise constant jerk of the path parameter, with s, ds/dt and d2s/dt2
/// continuous and both ends of a stretch at rest. Works in windows that depend on the program only; every
/// window's plan ends at rest, is verified on the law itself and replaces the verified one before. Throws
/// ProgramError ("line N: ...", without the file) when the map fails or a joint leaves its range; the
/// verified plan up to a standstill before that place has then been emitted, and only destruction is left.
class SpeedPlanner : public PieceSink {
 public:
  /// All references must outlive the planner.
  SpeedPlanner(const Joints& joints, const JointMap& map, const SpeedOptions& options, BlockSink& out);

  void piece(const PlanPiece& piece) override;
  void event(const QueueEvent& event, std::uint32_t line) override;
  /// Ends the stretch that is open, if any, at the end of its last piece.
  void finish();

  const SpeedStats& stats() const { return stats_; }

 private:
  /// Where the next window begins.
  struct Start {
    bool at_rest = true;
    speed::PathState state;  ///< the true motion
    speed::SpeedState plan;  ///< the solution's
  };
  void accept(const PlanPiece& piece);
  void advance(bool to_end);
  void plan_window(bool final);
  bool try_window(bool final);
  bool try_shorter(size_t count);
  void adopt();
  size_t segments_within(double time_s) const;
  bool solve_window(size_t head, size_t tail);
  void guess(size_t head, size_t tail);
  void damp_undershoot(size_t head);
  bool make_law(size_t head, size_t tail);
  bool verify(int round);
  void slow_place(size_t interval, const speed::LawSegment& segment, double excess);
  bool slow_down(size_t head, size_t tail);
  void creep();
  void commit(size_t segments, size_t head);
  void drop_intervals(size_t count);
  void emit_rest();
  double law_time() const;

  SpeedOptions options_;
  speed::PathSampler sampler_;
  speed::PathGrid grid_;
  speed::BlockEmitter emitter_;
  speed::InteriorPoint solver_;
  double brake_s_ = 0;
  SpeedStats stats_;

  bool open_ = false;  ///< a stretch has begun and its end is not planned
  double s_next_ = 0;
  PlanPiece last_;
  Start start_;
  std::deque<speed::Headroom> headroom_;  ///< per interval of the grid
  std::vector<speed::LawSegment> law_;    ///< verified, from start_ to rest
  std::vector<speed::LawSegment> candidate_;
  speed::SpeedProblem problem_;
  speed::PlanEnd head_end_, tail_end_;
  speed::Doubles c_, c_before_;  ///< of the window; of the verified plan, from the grid's first interval
  std::vector<speed::SpeedState> nodes_before_;  ///< of the verified plan, at the left ends of c_before_
  int retries_ = 0;                              ///< since the last window that was found
};

}  // namespace trn
