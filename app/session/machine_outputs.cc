#include "app/session/machine_outputs.h"

#include <cmath>

#include "app/session/program_step.h"

namespace trn {

void adopt_outputs(const MachineOutputs& outputs, const Assembly& assembly, const Parameters& parameters,
                   const ToolTable& tools, std::optional<Settings>& kept) {
  const bool on = (outputs.rpm_known && outputs.rpm != 0) || outputs.coolant != 0;
  if (!kept && !on) return;
  if (!kept) kept = idle_step(assembly, parameters, tools, nullptr).settings;
  ModalState& modal = kept->modal;
  modal.mist = (outputs.coolant & 1) != 0;
  modal.flood = (outputs.coolant & 2) != 0;
  if (outputs.broken_off) kept->spindle_is_axis = false;
  if (!outputs.rpm_known) return;
  const SpindleTurn turn = outputs.rpm > 0   ? SpindleTurn::kClockwise
                           : outputs.rpm < 0 ? SpindleTurn::kCounterclockwise
                                             : SpindleTurn::kStopped;
  if (turn != SpindleTurn::kStopped && modal.turn == SpindleTurn::kStopped) {
    modal.speed = std::abs(outputs.rpm);
    modal.css = false;
    modal.css_max = 0;
  }
  modal.turn = turn;
}

}  // namespace trn
