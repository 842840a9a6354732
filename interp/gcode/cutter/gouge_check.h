#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "interp/gcode/cutter/box_tree.h"
#include "interp/gcode/cutter/plane_curve.h"
#include "interp/gcode/error.h"

namespace trn {

/// Judges the path of a compensated tool against the finished contour: no wall may come closer to the tool's
/// centre than its radius while the tool is as deep as the wall.
///
/// Where the contour meets itself it has closed, and what lies between the two passes is the wall of the
/// part. The way in before that and the way out behind it are no walls, but the tool may not cut the part
/// there either. What follows a closed contour (a second lap, an overlap, another contour) is judged on its
/// own: it may cut what the earlier one has left. A contour that does not close is wall from end to end, but
/// for an arc bent round the tool that leads tangentially on to it or off it. A contour ends with a rapid,
/// with a move along the tool and with the compensation.
///
/// A way in may run through a wall beside an inside corner. The contour then closes there at first, and soon
/// closes anew where the wall comes back to the end of the way in. It is judged both ways.
///
/// It is judged when it has closed or ended, for only then it is known what is wall.
class GougeCheck {
 public:
  /// One move: the contour and the tool's centre beside it, with the arc about the corner behind it.
  struct Move {
    PlaneCurve contour, path;
    std::optional<PlaneCurve> corner;
    double from_height = 0, to_height = 0;  ///< along the plane's normal
    double path_slack = 0, wall_slack = 0;  ///< how far off the path and the contour may be
    BlockPlace place;
  };
  /// The later and the earlier of the tool's move and the wall's; `entry`: the tool's is the entry move.
  struct Gouge {
    BlockPlace place, other;
    bool entry = false;
  };

  /// A contour begins, with the tool of this radius on its left or right. `rounding`: of the program's
  /// numbers; nearer to a wall by no more than this is no gouge.
  void begin(double radius, bool left, double rounding);
  /// The move on which the compensation begins: no wall.
  void enter(const Move& move);
  /// The next move of the contour.
  void add(const Move& move);
  /// The contour ends.
  void end();
  /// What has been found since `begin`, once.
  std::vector<Gouge> take();

  static constexpr std::size_t kMovesMax = 200'000;  ///< bounds the memory: a longer contour ends there

 private:
  /// A place on the contour.
  struct Station {
    std::size_t move;
    double fraction;
  };
  struct Contour {
    std::vector<Move> moves;
    std::vector<double> area, length;  ///< swept by all moves before, and theirs
    BoxTree tree;
    std::size_t first = 0, last = 0;  ///< of the moves that are wall
    void clear();
    void keep(const Move& move, double touch);
    double swept(std::size_t from, const Station& to) const;
  };
  /// What the tool's centre goes along.
  struct Sweep {
    PlaneCurve path;
    double from_height, to_height, slack;
  };

  bool too_near(const Sweep& sweep, const Move& wall) const;
  std::optional<std::size_t> wall_near(const Sweep& sweep, const Contour& walls) const;
  std::optional<std::size_t> wall_near(const Move& move, double first, double last,
                                       const Contour& walls) const;
  double enclosed(const Station& from, const Station& to) const;
  bool closes(const Station& from, const Station& to) const;
  template <typename Closes>
  std::optional<Station> ahead(const PlaneCurve& way, const Closes& closes_at) const;
  void close(const Station& start, double fraction);
  void follow(const Move& move, double first);
  bool nearly_closes();
  void close_anew();
  bool comes_back(const Station& station, double fraction) const;
  void judge(const Contour& contour);
  void judge_entry();
  void skip_leads();
  bool leads(std::size_t move, std::size_t neighbour) const;

  double radius_ = 0, least_ = 0;  ///< of the tool, and the least distance from a wall
  double touch_ = 0;               ///< places of the contour nearer to each other are one place
  bool left_ = true, told_ = false;
  std::optional<Move> entry_;
  Contour contour_;            ///< since it has begun, or has closed
  Contour loop_;               ///< the last one that has closed
  double loop_area_ = 0;       ///< it encloses
  bool way_in_meets_ = false;  ///< it has closed on the move that leads in
  bool closed_anew_ = false;
  std::optional<Gouge> tail_;  ///< of what follows it
  std::vector<Gouge> gouges_;
};

}  // namespace trn
