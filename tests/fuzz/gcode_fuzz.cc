#include <cstddef>
#include <cstdint>
#include <string>

#include "core/frames.h"
#include "core/motion.h"
#include "interp/gcode/axis_words.h"
#include "interp/gcode/error.h"
#include "interp/gcode/interpreter.h"
#include "interp/gcode/lowering.h"
#include "interp/gcode/parameters.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/tool_table.h"
#include "interp/move.h"

// Fuzz target: any bytes as a program, through the lowering, errors recovered from; bounded in steps. Run
// with -dict=tests/fuzz/gcode.dict and the corpus beside this file (see tests/fuzz/README.md).
namespace {

class Drop : public trn::MoveSink {
 public:
  void move(const trn::ProgramMove&) override {}
  void event(const trn::QueueEvent&, trn::SourceLine) override {}
};

constexpr int kMaxSteps = 250;  // a loop shows what it does soon
constexpr int kMaxErrors = 3;
constexpr std::size_t kRecoversEvery = 4;  // an error costs more than the rest of a run together

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace trn;
  ProgramConfig config;
  config.sub_path.clear();
  config.io = config.spindle_encoder = true;
  Parameters parameters;
  ToolTable tools;
  Drop drop;
  Lowering lowering(config, nullptr, drop);
  const bool asks = size % 3 != 0;
  Interpreter interpreter({config, parameters, tools, nullptr, lowering, {}, asks});
  interpreter.open_text(std::string(reinterpret_cast<const char*>(data), size), "fuzz.ngc");
  int errors_left = size % kRecoversEvery == 0 ? kMaxErrors : 0;
  for (int i = 0; i < kMaxSteps; ++i) {
    try {
      const ProgramWords ones{Vec3::Ones(), Vec3::Ones()};
      while (interpreter.waiting()) interpreter.answer({1, ones, ones});
      if (!interpreter.step()) break;
    } catch (const GcodeError&) {
      if (errors_left-- == 0 || !interpreter.recover()) break;
    }
  }
  return 0;
}
