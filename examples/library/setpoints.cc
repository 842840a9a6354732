// A path becomes setpoints that keep every limit of the machine's joints: setpoints MACHINE.toml
#include <trunnion/trunnion.h>

#include <cstdio>

int main(int argc, char** argv) try {
  const trunnion::Machine machine(argc > 1 ? argv[1] : "mill.toml");
  trunnion::Motion motion = machine.plan_text("G64 P0.05\nG1 X40 Y10 F3000\nX60 Y-20\nG0 X0 Y0\nM2\n");
  for (trunnion::Setpoint at; motion.next(at);)
    std::printf("%.3f s: X %.4f mm, %.3f mm/s\n", at.time_s, at.position[0], at.velocity[0]);
} catch (const trunnion::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
