#include "interp/gcode/modal.h"

#include <fmt/format.h>

#include <initializer_list>

namespace trn {

namespace {

struct GRow {
  GGroup group;
  std::initializer_list<int> codes10;
};
struct MRow {
  MGroup group;
  std::initializer_list<int> codes;
};

const GRow kGRows[] = {
    {GGroup::kNonModal, {40, 100, 280, 281, 300, 301, 520, 530, 531, 920, 921, 922, 923}},
    {GGroup::kMotion, {0,   10,  20,  30,  50,  51,  52,  53,  62,  330, 331, 382, 383, 384, 385,
                       730, 740, 760, 800, 810, 820, 830, 840, 850, 860, 870, 880, 890, 1830}},
    {GGroup::kPlane, {170, 180, 190}},
    {GGroup::kDistance, {900, 910}},
    {GGroup::kArcDistance, {901, 911}},
    {GGroup::kFeedMode, {930, 940, 950}},
    {GGroup::kUnits, {200, 210}},
    {GGroup::kCutterComp, {400, 410, 411, 420, 421}},
    {GGroup::kToolLength, {430, 431, 432, 434, 435, 490}},
    {GGroup::kRetract, {980, 990}},
    {GGroup::kWorkOffset, {540, 550, 560, 570, 580, 590, 591, 592, 593}},
    {GGroup::kPath, {610, 611, 640}},
    {GGroup::kSpindleMode, {960, 970}},
    {GGroup::kDiameter, {70, 80}},
    {GGroup::kTiltedPlane, {682, 690}},
};

const MRow kMRows[] = {
    {MGroup::kStop, {0, 1, 2, 30, 60}},
    {MGroup::kToolChange, {6, 61}},
    {MGroup::kSpindle, {3, 4, 5, 19}},
    {MGroup::kCoolant, {7, 8, 9}},
    {MGroup::kOverride, {48, 49, 50, 51, 52, 53}},
    {MGroup::kOutput, {62, 63, 64, 65, 66, 67, 68}},
    {MGroup::kState, {70, 71, 72, 73}},
    {MGroup::kSub, {98, 99}},
};

}  // namespace

ModalTable::ModalTable() {
  g_.fill(-1);
  m_.fill(-1);
  for (const GRow& row : kGRows)
    for (const int code : row.codes10) map_g(code, row.group);
  for (const MRow& row : kMRows)
    for (const int code : row.codes) map_m(code, row.group);
}

std::string g_name(int code10) {
  return code10 % 10 == 0 ? fmt::format("G{}", code10 / 10) : fmt::format("G{}.{}", code10 / 10, code10 % 10);
}

}  // namespace trn
