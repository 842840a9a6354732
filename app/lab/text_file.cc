#include "app/lab/text_file.h"

#include <fstream>
#include <stdexcept>

namespace trn {

void write_text_file(const std::string& path, const std::string& text) {
  std::ofstream out(path);
  out << text;
  if (!out.flush()) throw std::runtime_error(path + ": cannot write this file");
}

}  // namespace trn
