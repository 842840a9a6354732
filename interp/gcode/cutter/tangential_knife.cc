#include "interp/gcode/cutter/tangential_knife.h"

#include <cmath>
#include <utility>

#include "core/axes.h"
#include "core/check.h"
#include "core/units.h"
#include "interp/gcode/cutter/plane_curve.h"

namespace trn {

namespace {

using Point = PlaneCurve::Point;

constexpr double kSamePlace = 1e-9;  // mm or inch: no way, and no direction
constexpr double kNoCorner_deg = 1e-9;

/// The end of a move that the knife goes along.
ProgramWords* end_of(CanonCommand& command) {
  if (auto* traverse = std::get_if<canon::StraightTraverse>(&command)) return &traverse->to;
  if (auto* feed = std::get_if<canon::StraightFeed>(&command)) return &feed->to;
  if (auto* arc = std::get_if<canon::ArcFeed>(&command)) return &arc->to;
  return nullptr;
}

bool is_traverse(const CanonCommand& command) {
  return std::holds_alternative<canon::StraightTraverse>(command);
}

/// What may stand between two moves of a contour: it waits in its place.
bool may_wait(const CanonCommand& command) {
  return std::holds_alternative<canon::SetFeedRate>(command) ||
         std::holds_alternative<canon::SetMotionControlMode>(command) ||
         std::holds_alternative<canon::SetNaivecamTolerance>(command) ||
         std::holds_alternative<canon::Comment>(command);
}

/// Texts for people, which nothing of the motion depends on.
bool is_text(const CanonCommand& command) {
  return std::holds_alternative<canon::Message>(command) || std::holds_alternative<canon::Print>(command) ||
         std::holds_alternative<canon::Log>(command);
}

Point plane_of(const ProgramWords& words) { return words.xyz.head<2>(); }

double direction_deg(const Point& way) { return kDegPerRad * std::atan2(way.y(), way.x()); }

/// The short way round, in (-180, 180].
double short_turn(double deg) {
  const double turn = std::remainder(deg, 360.0);
  return turn == -180.0 ? 180.0 : turn;
}

}  // namespace

void TangentialKnife::start(const ProgramWords& from, double zero_deg, bool inch) {
  TRN_CHECK(held_.empty());
  TRN_CHECK(config_.axis >= kA && config_.axis <= kC);
  on_ = true;
  inch_ = inch;
  zero_deg_ = zero_deg;
  at_ = sent_ = from;
  word_deg_ = from[config_.axis];
}

double TangentialKnife::settle() {
  send(0, held_.size());
  return word_deg_;
}

void TangentialKnife::go_on_from(const ProgramWords& place) {
  settle();
  at_ = sent_ = place;
}

double TangentialKnife::stop() {
  const double word_deg = settle();
  on_ = in_work_ = false;
  return word_deg;
}

void TangentialKnife::put(const CanonCommand& command, std::uint32_t line) {
  if (!on_ || is_text(command)) return sink_.put(command, line);
  line_ = line;
  CanonCommand copy = command;
  if (const ProgramWords* to = end_of(copy)) return move(command, *to, line);
  if (!may_wait(command)) {
    settle();
    return sink_.put(command, line);
  }
  if (held_.empty()) return sink_.put(command, line);
  Held held{std::move(copy), line};
  if (const auto* comment = std::get_if<canon::Comment>(&command)) held.text = std::string(comment->text);
  held_.push_back(std::move(held));
}

void TangentialKnife::move(const CanonCommand& command, const ProgramWords& to, std::uint32_t line) {
  Cut cut;
  const bool cuts = cut_of(command, to, cut);
  const ProgramWords from = std::exchange(at_, to);
  const bool crosses = (plane_of(to) - plane_of(from)).norm() > kSamePlace;
  if (!cuts && !crosses && to[kZ] == from[kZ]) return;
  if (cuts) {
    turn_into(short_turn(cut.start_deg + zero_deg_ - word_deg_));
    word_deg_ += cut.turn_deg;
    cut_waits_ = true;
  } else {
    ++moves_;
  }
  const bool up = is_traverse(command) || to[kZ] > from[kZ];
  held_.push_back({command, line, {}, !cuts && up, !cuts && crosses});
}

// False for a move without a way in XY, and for a rapid.
bool TangentialKnife::cut_of(const CanonCommand& command, const ProgramWords& to, Cut& cut) const {
  const Point from = plane_of(at_), end = plane_of(to);
  if (const auto* arc = std::get_if<canon::ArcFeed>(&command)) {
    const Point given(arc->centre1, arc->centre2);
    const bool whole = (end - from).norm() <= kSamePlace;
    const PlaneCurve curve{from, end, whole ? given : centre_between(from, end, given),
                           arc->turns > 0 ? 1 : -1};
    const double sweep = whole ? 2 * kPi : sweep_of(curve.centre, from, end, curve.turn);
    cut.start_deg = direction_deg(direction_of(curve, false));
    cut.turn_deg = curve.turn * kDegPerRad * (sweep + 2 * kPi * (std::abs(arc->turns) - 1));
    return true;
  }
  if (is_traverse(command) || (end - from).norm() <= kSamePlace) return false;
  cut.start_deg = direction_deg(end - from);
  return true;
}

// Everything that waits goes out, and the knife is turned on the way to the cut that follows.
void TangentialKnife::turn_into(double turn_deg) {
  const std::size_t count = held_.size();
  if (cut_waits_ && moves_ == 0 && std::abs(turn_deg) <= config_.blend_deg) {
    // Half of the turn on either side, so that it stands off the path by no more than that. The way of the
    // word goes on from there: the rest of it belongs to the cut that follows.
    word_deg_ += turn_deg / 2;
    send(0, count);
    word_deg_ += turn_deg / 2;
    return;
  }
  std::size_t last_across = count, last_above = count + 1;
  if (!cut_waits_ && !in_work_) last_above = 0;
  for (std::size_t i = 0; i < count; ++i) {
    if (held_[i].crosses) last_across = i;
    if (held_[i].leads_up) last_above = i + 1;
  }
  if (std::abs(turn_deg) <= kNoCorner_deg) return send(0, count);
  if (last_across < count) return turn_before(last_across, turn_deg);
  if (last_above > count) {
    send(0, count);
    return corner(turn_deg);
  }
  send(0, last_above);
  word_deg_ += turn_deg;
  Held turn{canon::StraightTraverse{sent_}, line_};
  send(turn);
  send(0, held_.size());
}

// In the rapid itself, and all that comes behind it has the new word.
void TangentialKnife::turn_before(std::size_t index, double turn_deg) {
  send(0, index);
  word_deg_ += turn_deg;
  send(0, held_.size());
}

// In the work: up, turn, down. The tip stays where it is.
void TangentialKnife::corner(double turn_deg) {
  const bool lifts = std::abs(turn_deg) > config_.corner_deg;
  const ProgramWords below = sent_;
  ProgramWords above = below;
  if (lifts) above[kZ] += inch_ ? config_.lift_mm / kMmPerInch : config_.lift_mm;
  Held up{canon::StraightTraverse{above}, line_}, turn = up, down{canon::StraightFeed{below}, line_};
  if (lifts) send(up);
  word_deg_ += turn_deg;
  send(turn);
  if (lifts) send(down);
}

void TangentialKnife::send(std::size_t begin, std::size_t end) {
  TRN_CHECK(begin == 0 && end <= held_.size());
  for (std::size_t i = begin; i < end; ++i) send(held_[i]);
  held_.erase(held_.begin(), held_.begin() + static_cast<std::ptrdiff_t>(end));
  if (end == 0) return;
  cut_waits_ = false;
  moves_ = 0;
  for (Held& held : held_) moves_ += end_of(held.command) ? 1 : 0;
}

void TangentialKnife::send(Held& held) {
  if (auto* comment = std::get_if<canon::Comment>(&held.command)) comment->text = held.text;
  if (ProgramWords* to = end_of(held.command)) {
    (*to)[config_.axis] = word_deg_;
    const bool crosses = plane_of(*to) != plane_of(sent_), climbs = (*to)[kZ] > sent_[kZ];
    // A turn on the spot leaves the knife where it is.
    if (crosses || (*to)[kZ] != sent_[kZ]) in_work_ = !is_traverse(held.command) && (crosses || !climbs);
    sent_ = *to;
  }
  sink_.put(held.command, held.line);
}

}  // namespace trn
