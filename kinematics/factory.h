#pragma once

#include <memory>

#include "core/machine.h"
#include "core/ports.h"

namespace trn {

/// The kinematics that [kinematics] of the machine's config describes. Reads every key of the section; throws
/// ConfigError (file:line:column, key, remedy) for a geometry that cannot work. A new kind of machine is one
/// file in kinematics/machines/ and one row of the table in factory.cc.
std::unique_ptr<Kinematics> make_kinematics(const Machine& machine);

}  // namespace trn
