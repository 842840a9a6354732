#pragma once

#include <optional>
#include <vector>

#include "core/axes.h"
#include "core/motion.h"
#include "core/path.h"
#include "interp/move.h"
#include "interp/plan/geometry/corner_blender.h"
#include "interp/plan/geometry/path_item.h"
#include "interp/plan/geometry/run_fit.h"
#include "interp/plan/geometry/run_vertex.h"

namespace trn {

/// Recognises runs of tiny continuous lines as the curve they were taken from, and emits that curve; all else
/// goes through unchanged. A run ends
/// - at a corner: a sharp turn, or one that a blend inside the tolerance rounds without reaching the
///   neighbouring corners;
/// - at a long line, whose end becomes part of the curve, so that both join smoothly;
/// - at a change of context, mode, tolerance or traverse;
/// - where no curve fits.
///
/// Long runs are fitted in windows: the front of each fit is emitted, and its last knots and coefficients are
/// the given start of the next. The rest of the fit is kept, to fall back on when the next window fits
/// nothing.
class Compressor {
 public:
  explicit Compressor(CornerBlender& next) : next_(next) {}

  void add(const PathItem& item);

  /// No more moves come before a stop: everything goes to the blender.
  void flush();

 private:
  struct Move {
    FeedLimit feed;          ///< path_units_s by the run's parameter u
    double speed = 0;        ///< du/dt at which the move takes the time that was programmed, mm/s
    double units_per_u = 1;  ///< units of the move's own parameter in one of u
    SourceLine source;
  };
  /// The part of a span, from move `first` to before move `end`, that is driven under one limit.
  struct Part {
    double from = 0, to = 0;
    size_t first = 0, end = 0;
    FeedLimit feed;
  };

  bool continues_run(const PathItem& item) const;
  void start_run(const PathItem& item);
  void append(const PathItem& item, double length, double u);
  void add_long_line(const PathItem& line);
  void fit_all(RunEnd end);
  void fit_next(bool last, RunEnd end);
  RunFit fit_front(size_t count, RunEnd end) const;
  void emit_front(const RunFit& fit, size_t count);
  void fall_back(size_t count, size_t worst_vertex);
  void emit_lines(size_t count);
  void emit_lead_in();
  std::vector<PathItem> items_of(const RunFit& fit, int from, int to);
  void find_borders(const std::vector<PathPiece>& curve, double u0);
  double border_of(size_t vertex, const PathPiece& piece, double u0) const;
  FeedLimit limit_of(size_t move) const;
  size_t move_at(double u) const;
  std::vector<Part> parts_of(double u0, double length) const;
  void settle_ends(double length, std::vector<Part>& parts) const;
  double shift_max(size_t fast, size_t slow) const;
  void append_parts(const PathPiece& piece, double u0, double usage, std::vector<PathItem>& out) const;
  void emit_items(const std::vector<PathItem>& items, bool joins_next);
  void emit(const PathItem& item);
  void freeze(const RunFit& fit, int at);
  void drop_front(size_t count);
  bool in_run() const { return !moves_.empty(); }

  CornerBlender& next_;
  PathItem pattern_;        ///< what all moves of the run share
  Words origin_;            ///< of the vertices
  Words direction_;         ///< of the last move (by the path parameter)
  double last_length_ = 0;  ///< of the last move
  std::vector<RunVertex> vertices_;
  std::vector<double> borders_;      ///< where the curve that is emitted passes the vertices
  std::vector<Move> moves_;          ///< moves_[i] leads from vertex i to vertex i + 1
  std::optional<PathItem> lead_in_;  ///< a long line whose last kLineTail is the run's first chord
  std::optional<FrozenHead> head_;
  std::vector<PathItem> fallback_;  ///< fitted before and not emitted: from head_ on to vertex fallback_end_
  size_t fallback_end_ = 0;
  size_t window_ = 0;           ///< moves that the next fit takes, at most
  bool cut_at_window_ = false;  ///< the next fit ends its part of the run: nothing fitted further
  bool at_rest_ = true;         ///< nothing emitted since the last stop: no blend joins the run's start
};

}  // namespace trn
