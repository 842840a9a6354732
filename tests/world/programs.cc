#include "tests/world/programs.h"

#include <fmt/format.h>

#include <cmath>

namespace trn::world {

namespace {

double between(std::mt19937_64& random, double low, double high) {
  return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
}

int one_of(std::mt19937_64& random, int count) {
  return static_cast<int>(random() % static_cast<unsigned>(count));
}

std::string place(std::mt19937_64& random, const Means& means) {
  const std::string turn =
      means.rotary ? fmt::format(" A{:.2f} C{:.2f}", between(random, -60, 60), between(random, -180, 180))
                   : "";
  return fmt::format("X{:.3f} Y{:.3f} Z{:.3f}", between(random, -120, 120), between(random, -120, 120),
                     between(random, -10, 90)) +
         turn;
}

// A whole turn about a middle beside the place where the tool stands.
std::string circle(std::mt19937_64& random) {
  return fmt::format("{} I{:.3f} J{:.3f} F{:.0f}", one_of(random, 2) == 0 ? "G2" : "G3",
                     between(random, 2, 40), between(random, 2, 40), between(random, 200, 20000));
}

std::string wave(std::mt19937_64& random) {
  std::string text =
      fmt::format("G64 P{:.3f}\nF{:.0f}\n", between(random, 0.002, 0.1), between(random, 500, 15000));
  const double size = between(random, 1, 20), step = between(random, 0.1, 1);
  for (int i = 0; i < 60; ++i)
    text += fmt::format("G1 X{:.4f} Y{:.4f}\n", i * step, size * std::sin(0.1 * i));
  return text;
}

std::string probe(std::mt19937_64& random) {
  return fmt::format("G0 Z20\nG0 X{:.3f} Y{:.3f}\nG38.3 Z-30 F{:.0f}\nG0 Z30", between(random, -35, 35),
                     between(random, -35, 35), between(random, 50, 1500));
}

}  // namespace

std::string draw_line(std::mt19937_64& random, const Means& means) {
  switch (one_of(random, means.devices ? 12 : 9)) {
    case 0:
    case 1:
      return "G0 " + place(random, means);
    case 2:
    case 3:
    case 4:
      return fmt::format("G1 {} F{:.0f}", place(random, means), between(random, 100, 24000));
    case 5:
      return circle(random);
    case 6:
      return fmt::format("G4 P{:.3f}", between(random, 0.001, 0.3));
    case 7:
      return fmt::format("G10 L2 P{} X{:.3f}\n#100=[#100+1]", 7 + one_of(random, 3), between(random, -9, 9));
    case 9:
      return probe(random);
    case 10:
      return fmt::format("M3 S{:.0f}", between(random, 100, 2000));
    case 11:
      return fmt::format("M62 P0\nM64 P1\nM65 P1\nM63 P0");
    default:
      return one_of(random, 4) == 0 ? "M0" : "G61\nG1 X[#100 MOD 40] F3000";
  }
}

std::string draw_program(std::mt19937_64& random, const Means& means) {
  std::string text = "G21 G90 G17 G94 G64 P0.01\n";
  const int lines = 3 + one_of(random, 30);
  for (int i = 0; i < lines; ++i)
    text += (one_of(random, 6) == 0 ? wave(random) : draw_line(random, means)) + "\n";
  return text + "M2\n";
}

}  // namespace trn::world
