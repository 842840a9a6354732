#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "interp/gcode/axis_words.h"
#include "interp/gcode/canon.h"

namespace trn {

/// [tangential]: a knife whose turn about Z follows the path by itself.
struct TangentialConfig {
  int axis = -1;           ///< kA..kC: the word that turns it; -1: the machine has no such knife
  double corner_deg = 15;  ///< a sharper corner: up, turn, down
  double blend_deg = 4;    ///< a flatter one: it turns on its way, along both moves
  double lift_mm = 5;      ///< up by that
};

/// Tangential control of a knife: gives the canonical functions of a program the words of the axis that
/// turns it, so that its edge points along the path in XY. A move waits until the direction behind it is
/// known, other commands wait in between. Between two cuts the knife turns on its way at a flat corner, where
/// it stands at a middling one, and lifted out at a sharp one; on the way to a cut it turns in the last rapid
/// across, or else above the work. While it is off everything passes.
class TangentialKnife final : public CanonSink {
 public:
  TangentialKnife(const TangentialConfig& config, CanonSink& sink) : config_(config), sink_(sink) {}

  bool on() const { return on_; }
  /// From here on; `from` is where the tool stands, `zero_deg` the axis' word with the edge along +X of the
  /// program; `inch`: the program's unit of length. Nothing may wait.
  void start(const ProgramWords& from, double zero_deg, bool inch);
  /// Sends what waits; the knife turns no further. Returns the axis' word.
  double settle();
  /// Behind a block that was refused: the program goes on at another place.
  void go_on_from(const ProgramWords& place);
  /// Settles and ends.
  double stop();
  void put(const CanonCommand& command, std::uint32_t line) override;

 private:
  struct Held {
    CanonCommand command;
    std::uint32_t line = 0;
    std::string text = {};  ///< of a comment
    bool leads_up = false;  ///< behind it the knife is out of the work
    bool crosses = false;   ///< a rapid in XY
  };
  /// A move that cuts: the directions of its ends in degrees from +X, its own turn between them.
  struct Cut {
    double start_deg = 0, turn_deg = 0;
  };

  void move(const CanonCommand& command, const ProgramWords& to, std::uint32_t line);
  bool cut_of(const CanonCommand& command, const ProgramWords& to, Cut& cut) const;
  void turn_into(double turn_deg);
  void corner(double turn_deg);
  void turn_before(std::size_t index, double turn_deg);
  void send(std::size_t begin, std::size_t end);
  void send(Held& held);

  const TangentialConfig& config_;
  CanonSink& sink_;
  bool on_ = false, inch_ = false;
  double zero_deg_ = 0;
  double word_deg_ = 0;     ///< of the axis, at the end of what was sent and of what waits
  ProgramWords at_;         ///< where the program stands, what waits included
  ProgramWords sent_;       ///< where the machine stands
  bool in_work_ = false;    ///< and whether the knife may be in the work there
  bool cut_waits_ = false;  ///< the first of `held_` is a cut
  std::size_t moves_ = 0;   ///< that wait behind it
  std::vector<Held> held_;
  std::uint32_t line_ = 0;
};

}  // namespace trn
