#include "app/lab/text_file.h"

#include <fstream>

#include "core/safe_file.h"

namespace trn {

void write_text_file(const std::string& path, const std::string& text) {
  std::ofstream out(path);
  out << text;
  if (!out.flush()) throw OutputError(path + ": cannot write this file");
}

}  // namespace trn
