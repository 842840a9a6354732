#pragma once

#include <atomic>

#include "core/config.h"
#include "core/fault.h"
#include "core/machine.h"
#include "core/ports.h"
#include "sim/micromill/micro_mill_plant.h"
#include "sim/micromill/part_surface.h"

namespace trn {

/// Drives on the simulated micro-mill: joints X, Y and Z in this order. Encoders are absolute; a following
/// error beyond the limit is a fault. bring_up, shut_down and reset_faults may come from another thread.
class MicroMillDrives final : public Drives {
 public:
  struct Config {
    MicroMillPlant::Config plant;
    std::optional<PartSurface::Config> part;
    double following_error_max_mm = 1.0;
  };

  explicit MicroMillDrives(const Config& config);

  void bring_up() override { enable_asked_ = true; }
  void shut_down() noexcept override { disable_asked_ = true; }
  bool real() const override { return false; }
  void reset_faults() override { reset_asked_ = true; }

  void exchange(const Setpoints& setpoints, Feedback& feedback) TRN_RT override;
  void request_home(unsigned) TRN_RT override {}
  void quick_stop() TRN_RT override { set_enabled(false); }

  MicroMillPlant& plant() { return plant_; }

 private:
  void obey_requests() TRN_RT;
  void set_enabled(bool enabled) TRN_RT;
  void watch(const Setpoints& setpoints) TRN_RT;
  void report(Feedback& feedback) TRN_RT;

  Config config_;
  MicroMillPlant plant_;
  DriveState state_ = DriveState::kOff;
  Fault fault_ = Fault::kOk;
  int fault_joint_ = -1;
  std::atomic<bool> enable_asked_ = false, disable_asked_ = false, reset_asked_ = false;
};

/// Section [drives] of type "micro_mill": `seed` picks the plant (0: nominal), `mass_error` (share) makes the
/// moving masses differ from the nominal ones beyond what the seed does, `part` ("none", "round" or "square",
/// about the origin) is what is cut out of the plate. ConfigError as ConfigTable, also for a machine whose
/// joints are not X, Y and Z.
MicroMillDrives::Config read_micro_mill_drives(const Machine& machine, const ConfigTable& drives);

}  // namespace trn
