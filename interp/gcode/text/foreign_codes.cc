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
// On lathes these are turning cycles, on some mills holes along a circle or a line.
constexpr std::string_view kPattern =
    "there are no cycles of a lathe, and no patterns of holes: write the moves, or have the CAM program do "
    "it";
constexpr std::string_view kPocket =
    "there is no cycle for a pocket: circles are G2 and G3, whose P is their turns, and a CAM program clears "
    "pockets";
constexpr std::string_view kMacro = "o1234 call [1] [2] calls a sub-program with arguments";
constexpr std::string_view kSystems = "G54 to G59 and G59.1, G59.2 and G59.3 are the work coordinate systems";
constexpr std::string_view kCornerRounding =
    "G64 P0.02 says how far corners may be rounded, G61.1 stops at each";
constexpr std::string_view kSmoothing =
    "G64 P0.02 says how far corners may be rounded: write it, or name this code in [program] ignored";
constexpr std::string_view kProbing = "G38.2 moves until the probe touches, and #5061 to #5066 say where";
constexpr std::string_view kReference = "G28 and G30 go to the reference points";
constexpr std::string_view kTip = "G43.4 H1 controls the tool's tip, and G49 ends it";

// Of what stands in the first lines of many programs. The others would be missed where they are passed over.
constexpr std::string_view kNothingToEnd =
    "there is nothing that it could end: leave it out, or name it in [program] ignored";
constexpr std::string_view kAhead =
    "what is read ahead needs no limit: leave it out, or name it in [program] ignored";

struct ForeignG {
  GCode code;
  std::string_view advice;
};
// As the manuals of Fanuc, Haas, Mach3 and Sinumerik name them.
constexpr ForeignG kForeignG[] = {
    {9_g, kCornerRounding},
    {11_g, kNothingToEnd},
    {12_g, kPocket},
    {13_g, kPocket},
    {15_g, kNothingToEnd},
    {16_g, kPolarWords},
    {27_g, kReference},
    {29_g, kReference},
    {31_g, kProbing},
    {32_g, "G33 Z K cuts a thread, K being its pitch"},
    {34_g, kPattern},
    {35_g, kPattern},
    {36_g, kProbing},
    {37_g, kProbing},
    {44_g, "G43 adds the length of the tool table, G43.1 Z one of the line"},
    {50_g, kNothingToEnd},
    {51_g, kScaling},
    {54.1_g, kSystems},
    {62_g, kCornerRounding},
    {63_g, "G33.1 Z K taps rigidly, K being the pitch"},
    {65_g, kMacro},
    {66_g, kMacro},
    {67_g, kNothingToEnd},
    {68_g, kTurned},
    {70_g, kPattern},
    {71_g, kPattern},
    {72_g, kPattern},
    {103_g, kAhead},
    {110_g, kSystems},
    {143_g, kTip},
    {150_g, kPocket},
    {154_g, kSystems},
    {187_g, kSmoothing},
    {234_g, kTip},
    {500_g, "G53 on a line of its own moves in machine coordinates"},
    {505_g, kSystems},
    {601_g, kSmoothing},
    {602_g, kSmoothing},
    {641_g, kSmoothing},
    {642_g, kSmoothing},
};

struct ForeignM {
  int code;
  std::string_view advice;
};
constexpr ForeignM kForeignM[] = {
    {17, "M99 or o100 endsub ends a sub-program"},
    {29, "G33.1 Z K taps rigidly, K being the pitch"},
    {97, "M98 P calls a sub-program by its number, and o100 call one by its label"},
    {117, "(MSG, text) shows a text"},
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
