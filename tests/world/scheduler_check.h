#pragma once

#include <string>

namespace trn::world {

/// Tries the scheduler on threads that do nothing but meet; "" or what is wrong with it.
std::string check_scheduler();

}  // namespace trn::world
