#include "interp/gcode/cutter/box_tree.h"

namespace trn {

void BoxTree::add(const PlaneBox& box) {
  std::size_t index = size();
  if (levels_.empty()) levels_.emplace_back();
  for (Level& level : levels_) {
    if (index < level.size())
      level[index].extend(box);
    else
      level.push_back(box);
    // Each level has one box for kFan of the level below, and grows only at its end: contours come move by
    // move.
    index /= kFan;
  }
  while (levels_.back().size() > kFan) add_level();
}

void BoxTree::add_level() {
  Level above;
  for (std::size_t i = 0; i < levels_.back().size(); ++i) {
    if (i % kFan == 0) above.emplace_back();
    above.back().extend(levels_.back()[i]);
  }
  levels_.push_back(std::move(above));
}

}  // namespace trn
