#include "interp/gcode/text/foreign_codes.h"

#include <fmt/format.h>

#include <string_view>

#include "interp/gcode/error.h"

namespace trn {

namespace {

constexpr std::string_view kScaling =
    "nothing is scaled or mirrored: do it in the CAM program or with [expressions]";
constexpr std::string_view kTurned =
    "G10 L2 P1 R30 turns the system G54 by 30 degrees, and G68.2 lays a tilted plane";
constexpr std::string_view kPolarWords = "@ and ^ in a block are its polar coordinates, as G1 @20 ^90";
constexpr std::string_view kLathe =
    "there are no cycles of a lathe: write the moves, or have the CAM program do it";
constexpr std::string_view kMacro = "o1234 call [1] [2] calls a sub-program with arguments";

// Of what stands in the first lines of many programs. The others would be missed where they are passed over.
constexpr std::string_view kNothingToEnd =
    "there is nothing that it could end: leave it out, or name it in [program] ignored";

struct ForeignG {
  GCode code;
  std::string_view advice;
};
constexpr ForeignG kForeignG[] = {
    {15_g, kNothingToEnd}, {16_g, kPolarWords}, {32_g, "G33 Z K cuts a thread, K being its pitch"},
    {50_g, kNothingToEnd}, {51_g, kScaling},    {54.1_g, "G59.1, G59.2 and G59.3 are the systems behind G59"},
    {65_g, kMacro},        {66_g, kMacro},      {67_g, kNothingToEnd},
    {68_g, kTurned},       {70_g, kLathe},      {71_g, kLathe},
    {72_g, kLathe},
};

struct ForeignM {
  int code;
  std::string_view advice;
};
constexpr ForeignM kForeignM[] = {
    {29, "G33.1 Z K taps rigidly, K being the pitch"},
    {97, "M98 P calls a sub-program by its number, and o100 call one by its label"},
};

}  // namespace

void refuse_unknown_g(GCode code, std::uint32_t column) {
  for (const ForeignG& foreign : kForeignG)
    if (foreign.code == code) fail(GcodeErrorCode::kForeignCode, column, g_name(code), foreign.advice);
  fail(GcodeErrorCode::kUnknownG, column, g_name(code));
}

void refuse_unknown_m(int code, std::uint32_t column) {
  const std::string name = fmt::format("M{}", code);
  for (const ForeignM& foreign : kForeignM)
    if (foreign.code == code) fail(GcodeErrorCode::kForeignCode, column, name, foreign.advice);
  fail(GcodeErrorCode::kUnknownM, column, name);
}

}  // namespace trn
