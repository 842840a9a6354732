#include "core/ports.h"

namespace trn {

std::string_view to_string(KinStatus status) {
  switch (status) {
    case KinStatus::kOk:
      return "ok";
    case KinStatus::kUnreachable:
      return "unreachable";
    case KinStatus::kSingular:
      return "singular";
    case KinStatus::kLimit:
      return "limit";
  }
  return "unknown";
}

std::string Drives::explain_fault(int) const { return {}; }
std::string Drives::health() const { return {}; }
std::vector<std::string> Drives::warnings() const { return {}; }
std::string MachineIo::explain_fault() const { return {}; }
std::string MachineIo::health() const { return {}; }

}  // namespace trn
