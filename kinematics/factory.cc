#include "kinematics/factory.h"

#include "core/config.h"
#include "kinematics/machines/hexapod.h"
#include "kinematics/machines/rail_mill.h"
#include "kinematics/machines/serial.h"

namespace trn {

namespace {

struct MachineKind {
  const char* type;
  std::unique_ptr<Kinematics> (*make)(const Machine& machine, const ConfigTable& section);
};

constexpr MachineKind kKinds[] = {
    {"serial", make_serial},
    {"hexapod", make_hexapod},
    {"rail_mill", make_rail_mill},
};

}  // namespace

std::unique_ptr<Kinematics> make_kinematics(const Machine& machine) {
  const ConfigTable section = machine.root.table("kinematics");
  std::vector<std::string> types;
  for (const MachineKind& kind : kKinds) types.emplace_back(kind.type);
  const std::string type = section.choice("type", types);
  for (const MachineKind& kind : kKinds)
    if (type == kind.type) {
      auto made = kind.make(machine, section);
      section.finish();
      return made;
    }
  throw section.error("type", "unknown type of kinematics");
}

}  // namespace trn
