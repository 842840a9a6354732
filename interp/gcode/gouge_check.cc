#include "interp/gcode/gouge_check.h"

#include <algorithm>

namespace trn {

namespace {

constexpr double kTouch = 2e-3;   // of the radius: nearer by this much is a gouge; flat corners come near it
constexpr double kClosed = 1e-6;  // a contour that comes back so near to one of its points is closed
constexpr double kSameHeight = 1e-9;

PlaneBox box_of(const GougeCheck::Move& move) {
  PlaneBox box = box_of(move.contour);
  box.extend(box_of(move.path));
  if (move.corner) box.extend(box_of(*move.corner));
  return box;
}

}  // namespace

void GougeCheck::begin(double radius) {
  radius_ = radius;
  moves_.clear();
  levels_.clear();
}

// The tool beside one against the contour of the other, where both are at one height.
bool GougeCheck::gouges(const Move& one, const Move& two, double least) {
  if (one.low > two.high + kSameHeight || two.low > one.high + kSameHeight) return false;
  const auto too_near = [&](const Move& tool, const Move& wall) {
    return distance(tool.path, wall.contour) < least ||
           (tool.corner && distance(*tool.corner, wall.contour) < least);
  };
  return too_near(one, two) || too_near(two, one);
}

template <typename Visit>
void GougeCheck::near(const PlaneBox& box, std::size_t level, std::size_t first, std::size_t last,
                      const Visit& visit) const {
  for (std::size_t i = first; i < last; ++i) {
    if (!levels_[level][i].intersects(box)) continue;
    if (level == 0)
      visit(i);
    else
      near(box, level - 1, i * kFan, std::min((i + 1) * kFan, levels_[level - 1].size()), visit);
  }
}

void GougeCheck::keep(const Move& move) {
  if (moves_.size() == kMovesMax) begin(radius_);
  std::size_t index = moves_.size();
  moves_.push_back(move);
  const PlaneBox box = box_of(move);
  for (Level& level : levels_) {
    if (index < level.size())
      level[index].extend(box);
    else
      level.push_back(box);
    index /= kFan;
  }
  if (levels_.empty()) levels_.push_back({box});
  while (levels_.back().size() > kFan) add_level();
}

void GougeCheck::add_level() {
  Level above;
  for (std::size_t i = 0; i < levels_.back().size(); ++i) {
    if (i % kFan == 0) above.emplace_back();
    above.back().extend(levels_.back()[i]);
  }
  levels_.push_back(std::move(above));
}

bool GougeCheck::closes(const Move& move) const {
  return (move.contour.from - move.contour.to).norm() <= kClosed;
}

std::uint32_t GougeCheck::add(const Move& given) {
  Move move = given;
  bool closed = closes(move);
  std::size_t first = closed ? moves_.size() : 0;  // of the contour
  const auto nearly = PlaneBox::VectorType::Constant(kClosed);
  if (!levels_.empty())
    near(PlaneBox(move.contour.to - nearly, move.contour.to + nearly), levels_.size() - 1, 0,
         levels_.back().size(), [&](std::size_t i) {
           if ((moves_[i].contour.from - move.contour.to).norm() > kClosed) return;
           closed = true;
           first = std::max(first, i);
         });
  // The way into a closed contour and the way out of it, the last corner included, are not part of it.
  if (closed) move.corner.reset();
  PlaneBox box = box_of(move);
  const auto reach = PlaneBox::VectorType::Constant(radius_);
  box = PlaneBox(box.min() - reach, box.max() + reach);
  std::uint32_t other = 0;
  const std::size_t neighbour = moves_.size() - 1;  // was joined at the corner
  if (!levels_.empty())
    near(box, levels_.size() - 1, 0, levels_.back().size(), [&](std::size_t i) {
      if (other == 0 && i != neighbour && i >= first && gouges(move, moves_[i], radius_ * (1 - kTouch)))
        other = moves_[i].line;
    });
  if (closed)
    begin(radius_);
  else
    keep(move);
  return other;
}

}  // namespace trn
