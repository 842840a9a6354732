#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "interp/gcode/canon.h"
#include "interp/gcode/cutter/gouge_check.h"
#include "interp/gcode/error.h"
#include "interp/gcode/executor.h"
#include "interp/gcode/g_code.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/text/block.h"
#include "interp/gcode/tool_table.h"

namespace trn {

namespace {

// The last digit of most programs: three decimals of a millimetre, four of an inch.
constexpr double kRounding_mm = 1e-3, kRounding_inch = 1e-4;

}  // namespace

// G41 G42 (radius from the tool table), G41.1 G42.1 (diameter by D), G40.
void Executor::cutter_comp(const Block& b) {
  const GCode code = b.code(GGroup::kCutterComp);
  const std::uint32_t column = b.at(GGroup::kCutterComp);
  if (code == 40_g) {
    flush_comp();
    return note("interpreter: cutter radius compensation off");
  }
  const std::string name = g_name(code);
  if (comp_.active()) fail(GcodeErrorCode::kCompState, column, name);
  if (s_.modal.plane == Plane::kYZ) fail(GcodeErrorCode::kPlane, column, name, "G19", "G17 or G18");
  // The offset lies in the plane of the machine's axes; with RTCP the tool need not stand square to it.
  if (s_.rtcp) fail(GcodeErrorCode::kCompCorner, column, "not with tool-centre-point control", "G49 first");
  double diameter = 0;
  int orientation = 0;
  if (code == 41.1_g || code == 42.1_g) {
    if (!b.has('D')) fail(GcodeErrorCode::kMissingWord, column, name, "a D word, the diameter");
    if (b.has('L') && s_.modal.plane != Plane::kXZ)
      fail(GcodeErrorCode::kPlane, b.at('L'), name + " L", "G17", "L in G18 only");
    diameter = b['D'];
    orientation = static_cast<int>(b.get('L', 0));
    if (b.has('L') && (orientation != b['L'] || orientation < 0 || orientation > 9))
      fail(GcodeErrorCode::kBadValue, b.at('L'), 'L', b['L'], name, "an orientation from 0 to 9");
  } else {
    const double number = b.get('D', s_.current_tool);
    if (number != std::round(number) || number < 0) fail(GcodeErrorCode::kNotInteger, b.at('D'), 'D', number);
    const Tool* tool = parts_.tools.find(static_cast<int>(number));
    if (!tool && number != 0) unknown_tool(static_cast<int>(number), b.has('D') ? b.at('D') : column);
    diameter = tool ? from_mm(tool->diameter) : 0;
    orientation = tool ? tool->orientation : 0;
    // 0 and 9 are the centre of the nose, as of any mill. 1 to 8 are corners and edges of a lathe's insert,
    // which is held in ZX.
    if (orientation % 9 != 0 && s_.modal.plane != Plane::kXZ)
      fail(GcodeErrorCode::kPlane, column, name + " with a lathe's tool", "G17", "G18");
  }
  bool left = code == 41_g || code == 41.1_g;
  // A negative diameter, as for an inside measured as an outside, turns the side round.
  if (diameter < 0) left = !left;
  note(left ? "interpreter: cutter radius compensation on left"
            : "interpreter: cutter radius compensation on right");
  comp_.start(left, std::fabs(diameter) / 2, s_.modal.plane, s_.position,
              s_.modal.inch ? kRounding_inch : kRounding_mm, std::clamp(orientation, 0, 9));
}

void Executor::comp_move(const Block& b, const CanonCommand& command) {
  comp_.move(command, {line_, b.motion_column(), file_}, parts_.sink);
}

void Executor::flush_comp() {
  if (!comp_.active()) return;
  // The program goes on from the programmed point; the tool gets there with the next straight move.
  comp_.finish(parts_.sink);
  left_contour_ = true;
}

void Executor::finish() {
  flush_comp();
  if (s_.knife) switch_knife(false, 1, "the end");
}

// The radius is still that of the compensation that has found them.
std::vector<GcodeReport> Executor::take_gouges() {
  std::vector<GcodeReport> reports;
  for (const GougeCheck::Gouge& gouge : comp_.take_gouges()) {
    const std::string_view sentence =
        gouge.entry
            ? "the tool of radius {:.4f} gouges on its way in: the entry move of line {} cuts the contour "
              "of line {}; begin on the tool's side of it"
            : gcode_error_info(GcodeErrorCode::kCompGouge).sentence;
    reports.push_back(
        {gouge.place, fmt::format(fmt::runtime(sentence), comp_.radius(), gouge.place.line, gouge.other.line),
         !gouge.entry});
  }
  return reports;
}

}  // namespace trn
