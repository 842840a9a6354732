#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/paths.h"

namespace trn {

/// The shipped data sheet without these objects ("1016"), and with `more` behind it, as text.
inline std::string sheet_text(const std::vector<std::string>& without, const std::string& more = "",
                              const std::string& file = "/configs/eds/servo.eds") {
  std::ifstream in(source_dir() + file);
  std::ostringstream out;
  bool kept = true;
  for (std::string line; std::getline(in, line);) {
    if (!line.empty() && line[0] == '[')
      kept = std::none_of(without.begin(), without.end(),
                          [&](const std::string& index) { return line.substr(1, 4) == index; });
    if (kept) out << line << '\n';
  }
  out << more;
  return out.str();
}

/// One variable of a data sheet: "6085", its type, access and default, and further lines.
inline std::string variable(const std::string& section, const std::string& type, const std::string& access,
                            const std::string& value, const std::string& more = "") {
  return "\n[" + section + "]\nParameterName=Object " + section + "\nObjectType=0x7\nDataType=" + type +
         "\nAccessType=" + access + "\nDefaultValue=" + value + "\n" + more + "\n";
}

/// A record and what is in it.
inline std::string record(const std::string& index, const std::string& subs) {
  return "\n[" + index + "]\nParameterName=Record " + index + "\nObjectType=0x9\n" + subs;
}

/// A servo drive that counts speeds in revolutions a minute and ramps in that per second, as a maxon EPOS4
/// does; written from CiA 402-2's tables. `velocity`: the code of 0x60A9, `access`: of the three units.
inline std::string rpm_sheet(const std::string& velocity = "0x00B44700", const std::string& access = "rw",
                             const std::string& counts_per_revolution = "50000") {
  const std::string most = "HighLimit=50000\n";
  return sheet_text(
      {"1019", "6081", "6099"},
      variable("6081", "7", "rw", "1000", most) +
          record("6099", variable("6099sub0", "5", "ro", "2") + variable("6099sub1", "7", "rw", "100", most) +
                             variable("6099sub2", "7", "rw", "10", most)) +
          record("608F", variable("608Fsub0", "5", "ro", "2") +
                             variable("608Fsub1", "7", "ro", counts_per_revolution) +
                             variable("608Fsub2", "7", "ro", "1")) +
          variable("60A8", "7", "ro", "0x00B50000") + variable("60A9", "7", access, velocity) +
          variable("60AA", "7", access, "0x00C00300"));
}

/// The same in a file of its own; its path.
inline std::string sheet_file(const std::string& text) {
  std::string name = testing::UnitTest::GetInstance()->current_test_info()->name();
  name += testing::UnitTest::GetInstance()->current_test_info()->test_suite_name();
  for (char& c : name)
    if (!std::isalnum(static_cast<unsigned char>(c))) c = '_';
  const std::string path = testing::TempDir() + name + ".eds";
  std::ofstream(path) << text;
  return path;
}

}  // namespace trn
