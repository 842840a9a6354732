#include "interp/gcode/cutter/gouge_check.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "core/check.h"

namespace trn {

namespace {

using Point = PlaneCurve::Point;

constexpr double kMargin = 1e-4;  // of the radius: nearer to a wall by so little is no gouge
constexpr double kTouch = 1e-6;   // points so near to each other are one point
constexpr double kSliver = 1e-3;  // of the radius: a loop thinner than this is rounding, not a part
constexpr double kSameHeight = 1e-6;
constexpr double kTangent_rad = 0.05;  // as flat as a corner that is none
constexpr double kSameLap = 0.1;       // laps differ by less, of what they enclose
constexpr double kReach = 2;  // radii: an end that stops so short of the contour ahead of it closes it

PlaneBox around(const PlaneCurve& curve, double by) {
  const PlaneBox box = box_of(curve);
  const auto touch = PlaneBox::VectorType::Constant(by);
  return {box.min() - touch, box.max() + touch};
}

double mix(double from, double to, double fraction) { return from + fraction * (to - from); }

// The part of the path on which the tool is no higher than `height`; false if there is none.
bool lower_part(const PlaneCurve& path, double from, double to, double height, PlaneCurve& part) {
  part = path;
  height += kSameHeight;
  if (from <= height && to <= height) return true;
  if (from > height && to > height) return false;
  const double crossing = (height - from) / (to - from);
  part = from <= height ? piece_of(path, 0, crossing) : piece_of(path, crossing, 1);
  return true;
}

}  // namespace

void GougeCheck::Contour::clear() {
  moves.clear();
  area.clear();
  length.clear();
  tree.clear();
}

void GougeCheck::Contour::keep(const Move& move, double touch) {
  const bool began = !moves.empty();
  // Sums up to the beginning of each move, so that the area and the way between any two places take two
  // subtractions, and a contour of a hundred thousand moves is not gone through for every one of them.
  area.push_back(began ? area.back() + swept_area(moves.back().contour) : 0);
  length.push_back(began ? length.back() + length_of(moves.back().contour) : 0);
  moves.push_back(move);
  tree.add(around(move.contour, touch));
  first = 0;
  last = moves.size() - 1;
  TRN_CHECK(area.size() == moves.size() && length.size() == moves.size());
}

// By the walls from the start of a move to a place.
double GougeCheck::Contour::swept(std::size_t from, const Station& to) const {
  TRN_CHECK(from < moves.size() && to.move < moves.size());
  if (to.move < from) return 0;
  const double piece = swept_area(piece_of(moves[to.move].contour, 0, to.fraction));
  return to.move == from ? piece : swept_area(moves[from].contour) + area[to.move] - area[from + 1] + piece;
}

void GougeCheck::begin(double radius, bool left, double rounding) {
  radius_ = radius;
  // The last digit of a program moves the wall by as much, in both directions. A tool that is nearer than its
  // radius by only that has not gouged.
  least_ = std::max(0.0, radius * (1 - kMargin) - rounding);
  touch_ = std::max(kTouch, rounding);
  left_ = left;
  told_ = false;
  entry_.reset();
  contour_.clear();
  loop_.clear();
  tail_.reset();
  gouges_.clear();
}

void GougeCheck::enter(const Move& move) { entry_ = move; }

std::vector<GougeCheck::Gouge> GougeCheck::take() { return std::exchange(gouges_, {}); }

// The tool counts where it is as deep as the wall, whose deepest point is its depth.
bool GougeCheck::too_near(const Sweep& sweep, const Move& wall) const {
  const double least = least_ - sweep.slack - wall.wall_slack;
  PlaneCurve part;
  return lower_part(sweep.path, sweep.from_height, sweep.to_height,
                    std::min(wall.from_height, wall.to_height), part) &&
         distance(part, wall.contour) < least;
}

std::optional<std::size_t> GougeCheck::wall_near(const Sweep& sweep, const Contour& walls) const {
  std::optional<std::size_t> wall;
  walls.tree.near(box_of(sweep.path), least_, [&](std::size_t i) {
    if (i < walls.first || i > walls.last || !too_near(sweep, walls.moves[i])) return false;
    wall = i;
    return true;
  });
  return wall;
}

// The wall that the tool cuts into between two fractions of a move, its corner behind the whole of it.
std::optional<std::size_t> GougeCheck::wall_near(const Move& move, double first, double last,
                                                 const Contour& walls) const {
  if (last > first) {
    const Sweep sweep{piece_of(move.path, first, last), mix(move.from_height, move.to_height, first),
                      mix(move.from_height, move.to_height, last), move.path_slack};
    if (const auto wall = wall_near(sweep, walls)) return wall;
  }
  if (!move.corner || last < 1) return {};
  return wall_near(Sweep{*move.corner, move.to_height, move.to_height, 0}, walls);
}

// Area that the contour encloses between two of its places, closed by the straight line between them;
// positive counterclockwise. Sums of `swept_area` over whole moves are kept (Contour::area), so that only the
// two pieces at the ends are computed. 0 for a sliver, which comes of rounding.
double GougeCheck::enclosed(const Station& from, const Station& to) const {
  TRN_CHECK(from.move < contour_.moves.size() && to.move < contour_.moves.size());
  TRN_CHECK(from.move <= to.move);
  const PlaneCurve& one = contour_.moves[from.move].contour;
  const PlaneCurve& two = contour_.moves[to.move].contour;
  const Point start = point_at(one, from.fraction), end = point_at(two, to.fraction);
  double area = cross(end, start) / 2, length = (end - start).norm();
  const auto more = [&](const PlaneCurve& piece) {
    area += swept_area(piece);
    length += length_of(piece);
  };
  if (from.move == to.move) {
    more(piece_of(one, from.fraction, to.fraction));
  } else {
    more(piece_of(one, from.fraction, 1));
    more(piece_of(two, 0, to.fraction));
    area += contour_.area[to.move] - contour_.area[from.move + 1];
    length += contour_.length[to.move] - contour_.length[from.move + 1];
  }
  return std::abs(area) > kSliver * radius_ * length ? area : 0;
}

// Whether the contour closes between these places. Behind a closed contour, one that closes again within a
// radius of where that did is its next lap if it encloses nearly the same area; otherwise it is the way out
// and in again, which encloses no part.
bool GougeCheck::closes(const Station& from, const Station& to) const {
  const double area = enclosed(from, to);
  if (area == 0 || loop_.moves.empty()) return area != 0;
  const double way =
      contour_.length[from.move] + from.fraction * length_of(contour_.moves[from.move].contour);
  return way > radius_ || std::abs(area - loop_area_) < kSameLap * std::abs(loop_area_);
}

// Of the places of the contour that `way` meets and `closes_at` accepts, the one that it meets first.
// `closes_at` is given the place and the fraction of `way`.
template <typename Closes>
std::optional<GougeCheck::Station> GougeCheck::ahead(const PlaneCurve& way, const Closes& closes_at) const {
  std::optional<Station> found;
  double least = 2;
  const double same = touch_ / std::max(length_of(way), touch_);
  contour_.tree.near(box_of(way), 0, [&](std::size_t i) {
    const Meetings meets = meetings(contour_.moves[i].contour, way, touch_);
    for (std::size_t k = 0; k < meets.count; ++k) {
      const Station station{i, meets.at[k].one};
      if (meets.at[k].two > least + same || !closes_at(station, meets.at[k].two)) continue;
      least = std::min(least, meets.at[k].two);
      found = station;
    }
    return false;
  });
  return found;
}

// The next move may close the contour: where it first meets an earlier move so that something is enclosed, or
// by being a full circle itself. Otherwise it goes on with the contour, or follows one that has closed.
void GougeCheck::add(const Move& move) {
  if (told_) return;
  if (contour_.moves.size() == kMovesMax) end();
  contour_.keep(move, touch_);
  const std::size_t last = contour_.last;
  double fraction = 1;
  std::optional<Station> start = ahead(move.contour, [&](const Station& station, double at) {
    if (station.move == last || !closes(station, {last, at})) return false;
    fraction = at;
    return true;
  });
  const bool full_turn = (move.contour.from - move.contour.to).norm() <= kTouch;
  if (!start && full_turn && enclosed({last, 0}, {last, 1}) != 0) start = Station{last, 0};
  if (start) return close(*start, fraction);
  if (!loop_.moves.empty()) close_anew();
  follow(move, 0);
}

// Where the walls behind the first closing come back to those of the loop, with little between the two: the
// way in ends there.
void GougeCheck::close_anew() {
  if (closed_anew_ || told_) return;
  const Move& move = contour_.moves.back();
  std::optional<Station> met;
  double fraction = 2;
  loop_.tree.near(box_of(move.contour), 0, [&](std::size_t i) {
    if (i < loop_.first || i > loop_.last) return false;
    const Meetings meets = meetings(loop_.moves[i].contour, move.contour, touch_);
    for (std::size_t k = 0; k < meets.count; ++k) {
      const Station station{i, meets.at[k].one};
      if (meets.at[k].two >= fraction || !comes_back(station, meets.at[k].two)) continue;
      fraction = meets.at[k].two;
      met = station;
    }
    return false;
  });
  if (!met) return;
  closed_anew_ = true;
  Contour whole;
  for (const Move& wall : loop_.moves) whole.keep(wall, touch_);
  for (const Move& wall : contour_.moves) whole.keep(wall, touch_);
  PlaneCurve& last_wall = whole.moves.back().contour;
  last_wall = piece_of(last_wall, 0, fraction);
  PlaneCurve& first_wall = whole.moves[met->move].contour;
  first_wall = piece_of(first_wall, met->fraction, 1);
  whole.first = met->move;
  judge(whole);
}

// Whether the last move, at this fraction of it, comes back to this place of the closed contour in the sense
// of `close_anew`: at the same height, and either near the place where the loop closed (both ways there
// enclose little between them) or on the very move of the way in. A second lap encloses a sliver only and
// does not count.
bool GougeCheck::comes_back(const Station& station, double fraction) const {
  TRN_CHECK(station.move < loop_.moves.size() && !contour_.moves.empty());
  const Move& wall = loop_.moves[station.move];
  const Move& move = contour_.moves.back();
  const double rise = mix(move.from_height, move.to_height, fraction) -
                      mix(wall.from_height, wall.to_height, station.fraction);
  const double area =
      std::abs(loop_.swept(loop_.first, station) - contour_.swept(0, {contour_.last, fraction}));
  const double way = contour_.length[contour_.last] + fraction * length_of(move.contour);
  if (std::abs(rise) > kSameHeight || area <= kSliver * radius_ * way) return false;
  if (area < kSameLap * std::abs(loop_area_)) return true;
  return way_in_meets_ && station.move == loop_.first;
}

// What comes behind a closed contour. If that closes too, it may cut into the one before.
void GougeCheck::follow(const Move& move, double first) {
  // A tail is told only when the contour behind ends without a closing: if it closes as well, it was another
  // lap and is judged as one.
  if (loop_.moves.empty() || tail_) return;
  if (const auto wall = wall_near(move, first, 1, loop_))
    tail_ = Gouge{move.place, loop_.moves[*wall].place, false};
}

// The contour has closed: from `start` to `fraction` of its last move it is the wall of a part. Both moves
// are cut off there, the part is judged, and what is left of the last move begins what follows.
void GougeCheck::close(const Station& start, double fraction) {
  TRN_CHECK(start.move <= contour_.last && contour_.last < contour_.moves.size());
  loop_area_ = enclosed(start, {contour_.last, fraction});
  const Move closing = contour_.moves.back();
  // The tool's path is longer or shorter than its wall, so the place on the wall is carried over to the path
  // beside it.
  const double at = fraction_of(closing.path, point_at(closing.contour, fraction));
  PlaneCurve& first_wall = contour_.moves[start.move].contour;
  PlaneCurve& last_wall = contour_.moves.back().contour;
  contour_.first = start.move;
  way_in_meets_ = start.fraction > 0;
  last_wall = piece_of(last_wall, 0, fraction);
  first_wall = piece_of(first_wall, start.move == contour_.last ? 0 : start.fraction, 1);
  contour_.moves.back().path = piece_of(closing.path, 0, at);
  contour_.moves.back().corner.reset();
  judge_entry();
  judge(contour_);
  loop_ = std::move(contour_);
  contour_ = Contour();
  closed_anew_ = false;
  tail_.reset();
  Move rest = closing;
  rest.contour = piece_of(closing.contour, fraction, 1);
  rest.path = piece_of(closing.path, at, 1);
  rest.from_height = mix(closing.from_height, closing.to_height, fraction);
  const bool goes_on = length_of(rest.contour) > kTouch;
  if (goes_on) {
    contour_.keep(rest, touch_);
    close_anew();
  }
  follow(rest, goes_on ? 0 : 1);
}

// Whether a move is a lead-in or lead-out: an arc bent round the tool that runs tangentially into its
// neighbour.
bool GougeCheck::leads(std::size_t move, std::size_t neighbour) const {
  TRN_CHECK(move < contour_.moves.size() && neighbour < contour_.moves.size());
  TRN_CHECK(move != neighbour);
  const PlaneCurve& arc = contour_.moves[move].contour;
  // Bent round the tool: counterclockwise for G41. An arc the other way would be a part of the work.
  if ((arc.turn > 0) != left_ || arc.turn == 0) return false;
  const bool before = move < neighbour;
  const Point one = direction_of(arc, before);
  const Point two = direction_of(contour_.moves[neighbour].contour, !before);
  return one.dot(two) > std::cos(kTangent_rad);
}

void GougeCheck::skip_leads() {
  TRN_CHECK(contour_.first <= contour_.last);
  if (contour_.last > contour_.first && leads(contour_.first, contour_.first + 1)) ++contour_.first;
  if (contour_.last > contour_.first && leads(contour_.last, contour_.last - 1)) --contour_.last;
}

// The tool along the whole contour, and on the way to it, against the moves of it that are wall.
void GougeCheck::judge(const Contour& contour) {
  const std::size_t count = contour.moves.size();
  for (std::size_t i = 0; i < count; ++i) {
    const auto wall = wall_near(contour.moves[i], 0, 1, contour);
    if (!wall) continue;
    TRN_CHECK(*wall < count);
    const auto [earlier, later] = std::minmax(i, *wall);
    gouges_.push_back({contour.moves[later].place, contour.moves[earlier].place, false});
    told_ = true;
    return;
  }
}

void GougeCheck::judge_entry() {
  if (!entry_) return;
  if (const auto wall = wall_near(*entry_, 0, 1, contour_))
    gouges_.push_back({entry_->place, contour_.moves[*wall].place, true});
  entry_.reset();
}

// A contour whose end stops within kReach radii short of its own earlier part is taken as closed there, and
// one whose beginning lies so short of its later part likewise. Lead-ins and lead-outs, which `skip_leads`
// has taken off, do not count as such ends.
bool GougeCheck::nearly_closes() {
  const PlaneCurve first = contour_.moves.front().contour, last = contour_.moves.back().contour;
  const Station begin{0, 0}, end{contour_.moves.size() - 1, 1};
  const double reach = kReach * radius_ + kTouch;
  std::optional<Station> met;
  if (contour_.last == end.move) {
    const PlaneCurve way{last.to, last.to + reach * direction_of(last, true), Point::Zero(), 0};
    met = ahead(way, [&](const Station& station, double) { return enclosed(station, end) != 0; });
    if (met) {
      PlaneCurve& wall = contour_.moves[met->move].contour;
      wall = piece_of(wall, met->fraction, 1);
      contour_.first = met->move;
      return true;
    }
  }
  if (contour_.first != 0) return false;
  const PlaneCurve way{first.from, first.from - reach * direction_of(first, false), Point::Zero(), 0};
  met = ahead(way, [&](const Station& station, double) { return enclosed(begin, station) != 0; });
  if (!met) return false;
  PlaneCurve& wall = contour_.moves[met->move].contour;
  wall = piece_of(wall, 0, met->fraction);
  contour_.last = met->move;
  return true;
}

void GougeCheck::end() {
  if (!told_ && tail_) {
    gouges_.push_back(*tail_);
    told_ = true;
  } else if (!told_ && loop_.moves.empty() && !contour_.moves.empty()) {
    skip_leads();
    if (nearly_closes()) judge_entry();
    judge(contour_);
  }
  entry_.reset();
  contour_ = Contour();
  loop_ = Contour();
  tail_.reset();
}

}  // namespace trn
