#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "app/import/import_place.h"
#include "app/import/ini_file.h"

namespace trn {

/// One word of a line of HAL; parts of one INI value share the place of its name.
struct HalWord {
  std::string text = {};
  ImportPlace place = {};
};

/// A module that `loadrt` or a program that `loadusr` loads, with its arguments.
struct HalModule {
  std::string name = {};
  std::vector<HalWord> arguments = {};
  ImportPlace place = {};
  bool realtime = true;
};

struct HalSignal {
  std::string name = {};
  ImportPlace place = {};  ///< where it is first named
  std::vector<HalWord> pins = {};
};

/// What a pin is set to: by `setp`, or by `sets` over its signal.
struct HalValue {
  std::string text = {};  ///< "" if a pin of something else gives it while LinuxCNC runs
  ImportPlace place = {};
  std::string driver = {};  ///< one of the other pins of its signal then
};

/// What the HAL files of a configuration say, put together without running anything.
class HalSetup {
 public:
  /// Reads what [HAL] names: HALFILE, HALCMD, POSTGUI_HALFILE, POSTGUI_HALCMD; files that begin with LIB: are
  /// in `library`, as are those that are not beside the INI. ImportError for a line that is no HAL.
  static HalSetup load(const IniFile& ini, const ImportReader& read, const std::string& library);

  /// What `pin` is set to; nothing if nobody says.
  std::optional<HalValue> value_of(const std::string& pin) const;
  /// Signals that have a pin whose name begins with `prefix`.
  std::vector<const HalSignal*> signals_of(std::string_view prefix) const;
  bool has_module(std::string_view name) const;

  const std::vector<HalModule>& modules() const { return modules_; }
  const std::vector<HalSignal>& signals() const { return signals_; }
  const std::map<std::string, HalWord>& parameters() const { return pins_set_; }
  const std::vector<ImportGap>& gaps() const { return gaps_; }
  const std::vector<std::string>& files() const { return files_; }
  int functions() const { return functions_; }

 private:
  struct Context;

  void read_named(Context& context, const IniEntry& entry);
  void read_file(Context& context, const std::string& name, const std::string& path, ImportPlace named_at,
                 int depth);
  void read_text(Context& context, std::string_view text, const std::string& file, int first_line, int depth);
  void obey(Context& context, const std::vector<HalWord>& words, int depth);
  void obey_signal(const std::vector<HalWord>& words);
  void set_pin(const std::vector<HalWord>& words, bool short_form);
  void load_module(const std::vector<HalWord>& words);
  HalSignal& signal(const HalWord& name);

  std::vector<HalModule> modules_;
  std::vector<HalSignal> signals_;
  std::map<std::string, std::size_t> signal_at_, signal_of_pin_;
  std::map<std::string, HalWord> pins_set_, signals_set_;
  std::vector<ImportGap> gaps_;
  std::vector<std::string> files_;
  int functions_ = 0;  ///< `addf`
};

}  // namespace trn
