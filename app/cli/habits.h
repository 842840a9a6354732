#pragma once

#include <string>
#include <vector>

namespace trn {

/// A command line as people write it, in the form that the commands read: -.5 as -0.5, `jog X+` and `jog
/// Z-0.5` as `jog X +` and `jog Z -0.5`, `override rapid 50%` as `override 50 --of rapid`. Where nothing is
/// to be moved by a guess, as in `jog X10`, it stays as it is.
std::vector<std::string> as_commands_read(std::vector<std::string> words);

}  // namespace trn
