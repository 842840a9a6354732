#include "interp/gcode/cutter/box_tree.h"

#include <gtest/gtest.h>

#include <random>

namespace trn {
namespace {

// Against looking at every box, while the tree grows through three levels.
TEST(BoxTree, FindsInOrderWhatIsNearAndNothingElse) {
  std::mt19937_64 rng(5);
  std::uniform_real_distribution<double> u(0, 1);
  BoxTree tree;
  std::vector<PlaneBox> boxes;
  Eigen::Vector2d at(0, 0);
  for (int i = 0; i < 700; ++i) {
    const Eigen::Vector2d to = at + Eigen::Vector2d(u(rng) - 0.4, u(rng) - 0.5);
    boxes.emplace_back(at.cwiseMin(to), at.cwiseMax(to));
    tree.add(boxes.back());
    at = to;
    ASSERT_EQ(tree.size(), boxes.size());
    if (i % 17 != 0) continue;
    const PlaneBox& probe = boxes[static_cast<std::size_t>(u(rng) * i)];
    const double reach = 2 * u(rng);
    std::vector<std::size_t> found, expected;
    tree.near(probe, reach, [&](std::size_t k) {
      found.push_back(k);
      return false;
    });
    for (std::size_t k = 0; k < boxes.size(); ++k)
      if (boxes[k].squaredExteriorDistance(probe) <= reach * reach) expected.push_back(k);
    EXPECT_EQ(found, expected) << i;
  }
}

TEST(BoxTree, StopsWhenTheVisitorHasFoundItsBox) {
  BoxTree tree;
  const PlaneBox box(Eigen::Vector2d(0, 0), Eigen::Vector2d(1, 1));
  for (int i = 0; i < 40; ++i) tree.add(box);
  int visits = 0;
  tree.near(box, 1, [&](std::size_t) { return ++visits == 3; });
  EXPECT_EQ(visits, 3);
  tree.clear();
  EXPECT_EQ(tree.size(), 0U);
}

}  // namespace
}  // namespace trn
