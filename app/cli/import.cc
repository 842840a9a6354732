#include <fmt/format.h>

#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "app/cli/commands.h"
#include "app/import/config_writer.h"
#include "app/import/import_linuxcnc.h"
#include "app/import/import_place.h"
#include "app/import/imported_machine.h"
#include "app/session/assembly.h"
#include "core/config.h"
#include "core/safe_file.h"
#include "interp/gcode/parameter_file.h"
#include "interp/move.h"

namespace trn {

namespace {

namespace fs = std::filesystem;

struct ImportOptions {
  std::string ini, to = ".", library = "/usr/share/linuxcnc/hallib";
  bool json = false, force = false;
};

constexpr const char kImportFooter[] =
    "Reads the INI, the files that it includes, its HAL files, tool table and variables, and writes beside "
    "each other\n"
    "  NAME.toml  the machine, with a comment in its place for all that was chosen or not carried over\n"
    "  NAME.tbl   the tools, in mm\n"
    "  NAME.var   offsets and parameters, in mm\n"
    "NAME is that of the INI. The same comments go to stderr, each with file, line and column of what it is "
    "about.\n"
    "The drives of the new machine are simulated, so that you can try at once:\n"
    "  trunnion import linuxcnc ~/linuxcnc/configs/mill/mill.ini --to mill\n"
    "  trunnion run part.ngc --machine mill/mill.toml --tools mill/mill.tbl --vars mill/mill.var\n"
    "Carried over: joints with limits, velocity, acceleration, homing and backlash; the kinematics "
    "trivkins,\n"
    "xyzac-trt-kins, xyzbc-trt-kins, 5axiskins and genhexkins with what setp and sets say of them; tools, "
    "offsets, folders\n"
    "of sub-programs, M codes that call one. Scale and following error stand as comments beside each joint, "
    "for real\n"
    "drives. Named, and not carried over: what HAL wires, second motors of a gantry, U V W. Nothing of "
    "LinuxCNC is run,\n"
    "and nothing of it is changed. docs/from_linuxcnc.md has both side by side.\n"
    "Exit: 0 written, 3 a file cannot be understood (file:line:column and what would be right), 4 a machine "
    "that has no\n"
    "counterpart here (as another module of kinematics), 5 usage, or a file is there already and --force was "
    "not given.\n";

/// A target exists, or is one of the files that are read.
struct ImportUsage : std::runtime_error {
  using std::runtime_error::runtime_error;
};

struct ImportTarget {
  fs::path path;
  const std::string* text;
};

std::optional<std::string> read_for_import(const std::string& path) {
  constexpr std::uintmax_t kBytesMax = 64u << 20;
  std::error_code error;
  if (!fs::is_regular_file(path, error) || fs::file_size(path, error) > kBytesMax || error)
    return std::nullopt;
  try {
    return read_text_file(path);
  } catch (const ProgramError&) {
    return std::nullopt;
  }
}

std::vector<ImportTarget> import_targets(const ImportOptions& options, const ImportedFiles& files) {
  const fs::path stem = fs::path(options.to) / fs::path(options.ini).stem();
  const std::vector<ImportTarget> targets = {{stem.string() + ".toml", &files.config},
                                             {stem.string() + ".tbl", &files.tools},
                                             {stem.string() + ".var", &files.variables}};
  for (const ImportTarget& target : targets) {
    std::error_code error;
    if (!fs::exists(target.path, error)) continue;
    for (const std::string& read : files.read)
      if (fs::equivalent(read, target.path, error))
        throw ImportUsage(
            fmt::format("{}: this file of LinuxCNC would be overwritten; choose another folder with --to",
                        target.path.string()));
    if (!options.force)
      throw ImportUsage(
          fmt::format("{}: the file is there already; --force overwrites it", target.path.string()));
  }
  return targets;
}

void tell_import(const ImportOptions& options, const ImportedFiles& files,
                 const std::vector<ImportTarget>& targets) {
  for (const ImportNote& note : files.machine.notes) fmt::print(stderr, "{}\n", note_line(note));
  if (options.json) {
    nlohmann::ordered_json out = import_json(files);
    out["written"] = nlohmann::ordered_json::array();
    for (const ImportTarget& target : targets) out["written"].push_back(target.path.string());
    fmt::print("{}\n", out.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
    return;
  }
  for (const ImportTarget& target : targets) fmt::print("{}\n", target.path.string());
  fmt::print("{} joints, kinematics {}, {} notes\n", files.machine.joints.size(), files.machine.kinematics,
             files.machine.notes.size());
}

Exit told_import(const std::exception& error, Exit exit) {
  fmt::print(stderr, "{}\n", error.what());
  return exit;
}

Exit import_machine(const ImportOptions& options) {
  try {
    const std::string library = options.library.ends_with('/') ? options.library : options.library + "/";
    const ImportedFiles files = import_linuxcnc(options.ini, read_for_import, library);
    try {
      assemble(parse_config(files.config, fs::path(options.ini).stem().string() + ".toml"));
    } catch (const ConfigError& error) {
      throw ImportRefusal({options.ini},
                          fmt::format("no legal config comes of this machine: {}", error.what()));
    }
    const std::vector<ImportTarget> targets = import_targets(options, files);
    fs::create_directories(options.to);
    for (const ImportTarget& target : targets) write_file_safely(target.path.string(), *target.text);
    tell_import(options, files, targets);
    return Exit::kDone;
  } catch (const ImportError& error) {
    return told_import(error, Exit::kBadConfig);
  } catch (const ImportRefusal& error) {
    return told_import(error, Exit::kMachineFault);
  } catch (const ImportUsage& error) {
    return told_import(error, Exit::kUsage);
  } catch (const FileError& error) {
    return told_import(error, Exit::kUsage);
  } catch (const fs::filesystem_error& error) {
    return told_import(error, Exit::kUsage);
  }
}

}  // namespace

void add_import(CLI::App& app, Exit& exit) {
  CLI::App* import = app.add_subcommand("import", "Make a config of another control's machine");
  import->require_subcommand(1);
  auto options = std::make_shared<ImportOptions>();
  CLI::App* command = import->add_subcommand("linuxcnc", "make a config of a machine of LinuxCNC");
  command->add_option("ini", options->ini, "the machine's INI file")->required();
  command->add_option("--to", options->to, "folder of the new files; it is made if it is not there")
      ->capture_default_str();
  command
      ->add_option("--hal-library", options->library,
                   "folder of LinuxCNC's own HAL files (HALFILE = LIB:...)")
      ->capture_default_str();
  command->add_flag("--json", options->json, "axes, notes and the new files as JSON");
  command->add_flag("--force", options->force, "overwrite what is there from an import before");
  command->footer(kImportFooter);
  command->callback([options, &exit] { exit = import_machine(*options); });
}

}  // namespace trn
