// G-code is read, and nothing else: moves PROGRAM.ngc [TOOLS.tbl]
#include <trunnion/trunnion.h>

#include <cstdio>

int main(int argc, char** argv) try {
  if (argc < 2) {
    std::fputs("usage: moves PROGRAM.ngc [TOOLS.tbl]\n", stderr);
    return 2;
  }
  for (const trunnion::Move& move : trunnion::read_gcode(argv[1], argc > 2 ? argv[2] : ""))
    std::printf("line %u: to X%.3f Y%.3f Z%.3f, %.0f mm/min\n", move.line, move.to[0], move.to[1], move.to[2],
                60 * move.feed_mm_s);
} catch (const trunnion::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
