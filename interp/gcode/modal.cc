#include "interp/gcode/modal.h"

#include <initializer_list>

namespace trn {

namespace {

struct GRow {
  GGroup group;
  std::initializer_list<GCode> codes;
};
struct MRow {
  MGroup group;
  std::initializer_list<int> codes;
};

const GRow kGRows[] = {
    {GGroup::kNonModal,
     {4_g, 10_g, 28_g, 28.1_g, 30_g, 30.1_g, 52_g, 53_g, 53.1_g, 92_g, 92.1_g, 92.2_g, 92.3_g}},
    {GGroup::kMotion,
     {0_g,  1_g,  2_g,  3_g,  5_g,  5.1_g, 5.2_g, 5.3_g, 6.2_g, 33_g, 33.1_g, 38.2_g, 38.3_g, 38.4_g, 38.5_g,
      73_g, 74_g, 76_g, 80_g, 81_g, 82_g,  83_g,  84_g,  85_g,  86_g, 87_g,   88_g,   89_g,   183_g}},
    {GGroup::kPlane, {17_g, 18_g, 19_g}},
    {GGroup::kDistance, {90_g, 91_g}},
    {GGroup::kArcDistance, {90.1_g, 91.1_g}},
    {GGroup::kFeedMode, {93_g, 94_g, 95_g}},
    {GGroup::kUnits, {20_g, 21_g}},
    {GGroup::kCutterComp, {40_g, 41_g, 41.1_g, 42_g, 42.1_g}},
    {GGroup::kToolLength, {43_g, 43.1_g, 43.2_g, 43.4_g, 43.5_g, 49_g}},
    {GGroup::kRetract, {98_g, 99_g}},
    {GGroup::kWorkOffset, {54_g, 55_g, 56_g, 57_g, 58_g, 59_g, 59.1_g, 59.2_g, 59.3_g}},
    {GGroup::kPath, {61_g, 61.1_g, 64_g}},
    {GGroup::kSpindleMode, {96_g, 97_g}},
    {GGroup::kDiameter, {7_g, 8_g}},
    {GGroup::kTiltedPlane, {68.2_g, 68.3_g, 69_g}},
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
    for (const GCode code : row.codes) map_g(code, row.group);
  for (const MRow& row : kMRows)
    for (const int code : row.codes) map_m(code, row.group);
}

}  // namespace trn
