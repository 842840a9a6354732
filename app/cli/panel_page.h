#pragma once

#include <string>

namespace trn {

/// The folder of the operator's page that was built or installed with this program; "" where there is none.
/// `named`: this one, if a page is there.
std::string find_panel_page(const std::string& named);

/// Path of this program.
std::string own_program();

}  // namespace trn
