#include "app/client/command_table.h"

namespace trn {

using trunnion::command_t;

bool makes_safe(const command_t& command) {
  const CommandRow* row = find_command(command.verb);
  if (!row || row->makes_safe == MakesSafe::kNever) return false;
  return row->makes_safe == MakesSafe::kAlways || command.value == 0;
}

Role role_for(const command_t& command) {
  if (makes_safe(command)) return Role::kLook;
  const CommandRow* row = find_command(command.verb);
  return row ? row->role : Role::kOperate;
}

}  // namespace trn
