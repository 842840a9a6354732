#include "app/cli/config_specimens.h"

#include <fmt/format.h>
#include <sys/mman.h>
#include <unistd.h>

#include <stdexcept>
#include <utility>

#include "app/cli/config_specimen_texts.h"
#include "app/session/assembly.h"
#include "compensation/micromill/friction_network.h"
#include "core/config.h"
#include "interp/gcode/program_config.h"
#include "sim/canopen/fault_script.h"

namespace trn {

namespace {

/// A file that is in memory only: the readers of drives take the name of a data sheet.
class FileInMemory {
 public:
  explicit FileInMemory(const std::string& text) : fd_(memfd_create("specimen", MFD_CLOEXEC)) {
    if (fd_ < 0 || write(fd_, text.data(), text.size()) != static_cast<ssize_t>(text.size()))
      throw std::runtime_error("a file in memory cannot be written");
  }
  ~FileInMemory() { close(fd_); }
  FileInMemory(const FileInMemory&) = delete;
  FileInMemory& operator=(const FileInMemory&) = delete;
  std::string path() const { return fmt::format("/proc/self/fd/{}", fd_); }

 private:
  int fd_;
};

/// The objects that setpoints, feedback and touch probe need, and one to be written.
std::string data_sheet() {
  constexpr std::pair<unsigned, unsigned> kObjects[] = {
      {0x605B, 3}, {0x605C, 3}, {0x605D, 3}, {0x6066, 6}, {0x2110, 7}, {0x6040, 6}, {0x6041, 6}, {0x6060, 2},
      {0x6061, 2}, {0x6064, 4}, {0x607A, 4}, {0x60B8, 6}, {0x60B9, 6}, {0x60BA, 4}, {0x60BB, 4}, {0x60FD, 7}};
  std::string text;
  for (const auto& [index, type] : kObjects)
    text += fmt::format(
        "[{0:04X}]\nParameterName=Object {0:04X}\nObjectType=7\nDataType={1}\nAccessType=rw\nPDOMapping=1\n",
        index, type);
  // A record, of a holding brake.
  text += "[60FE]\nParameterName=Outputs\nObjectType=9\nSubNumber=3\n";
  for (const int sub : {1, 2})
    text += fmt::format(
        "[60FEsub{}]\nParameterName=Object 60FE\nObjectType=7\nDataType=7\nAccessType=rw\nPDOMapping=1\n",
        sub);
  return text;
}

/// What differs between the two readings of a specimen: `@name` stands for a word of the first or the second.
struct Blank {
  const char* name;
  const char *first, *second;
};
constexpr Blank kBlanks[] = {{"@X", "X", "ram"},          {"@Y", "Y", "saddle"},
                             {"@Z", "Z", "quill"},        {"@A", "A", "cradle"},
                             {"@C", "C", "plate"},        {"@range", "400.0", "500.0"},
                             {"@low", "-250.0", "5"},     {"@k", "1", "2"},
                             {"@bool", "true", "false"},  {"@device", "box", "io"},
                             {"@bearing", "1300", "1400"}};

std::string filled(std::string text, bool second) {
  for (const Blank& blank : kBlanks)
    for (std::size_t at = 0; (at = text.find(blank.name, at)) != std::string::npos;)
      text.replace(at, std::string_view(blank.name).size(), second ? blank.second : blank.first);
  return text;
}

void replace_all(std::string& text, std::string_view word, std::string_view by) {
  for (std::size_t at = 0; (at = text.find(word, at)) != std::string::npos; at += by.size())
    text.replace(at, word.size(), by);
}

template <class Read>
void ask(std::vector<AskedSpecimen>& out, const std::string& name, const std::string& text, Read read) {
  const auto record = std::make_shared<ConfigRecord>();
  read(parse_config(text, name, record));
  out.push_back({name, *record});
}

}  // namespace

std::vector<AskedSpecimen> ask_all_readers() {
  const FileInMemory sheet(data_sheet());
  std::vector<AskedSpecimen> out;
  for (const bool second : {false, true}) {
    for (const ConfigSpecimen& specimen : machine_specimens()) {
      std::string text = filled(specimen.text + (second ? specimen.second_only : ""), second);
      replace_all(text, "@sheet", sheet.path());
      ask(out, fmt::format("{} {}", specimen.name, second ? 2 : 1), text,
          [](const ConfigTable& root) { assemble(root); });
    }
  }
  ask(out, "spindle axis", kSpindleAxisSpecimen, [](const ConfigTable& root) { read_program_config(root); });
  ask(out, "fault script", kFaultScriptSpecimen, [](const ConfigTable& root) { read_fault_script(root); });
  ask(out, "networks", kNetworksSpecimen, [](const ConfigTable& root) { read_networks(root); });
  return out;
}

}  // namespace trn
