#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

namespace trn {

/// Numbered parameters of the dialect. Lengths are kept in mm, angles in degrees.
namespace parameter {
inline constexpr int kLocalCount = 30;  ///< #1 .. #30 belong to the sub-program
inline constexpr int kProbe = 5061, kProbeSuccess = 5070, kG28 = 5161, kG30 = 5181, kG92Active = 5210,
                     kG92 = 5211;
inline constexpr int kSystem = 5220, kFirstOffset = 5221, kOffsetStride = 20, kOffsetRotation = 9,
                     kLastOffset = 5390;
inline constexpr int kInputResult = 5399, kTool = 5400, kToolOffset = 5401, kToolDiameter = 5410;
inline constexpr int kPosition = 5420;
inline constexpr int kDebugOutput = 5599;  ///< (DEBUG,...) speaks where it is above 0
inline constexpr int kMax = 5601;
inline constexpr int kUserFirst = kLocalCount + 1, kUserLast = 5000;  ///< free for programs, and kept
inline constexpr int kMachineFirst = kProbe, kMachineLast = kTool;    ///< offsets, homes, tool in the spindle
}  // namespace parameter

/// Names to small numbers and back; for parameters and O-word labels.
class NameTable {
 public:
  std::int32_t intern(std::string_view name);
  const std::string& name(std::int32_t id) const { return names_[static_cast<std::size_t>(id)]; }
  std::size_t size() const { return names_.size(); }

 private:
  struct Hash {
    using is_transparent = void;
    std::size_t operator()(std::string_view text) const { return std::hash<std::string_view>{}(text); }
  };
  std::unordered_map<std::string, std::int32_t, Hash, std::equal_to<>> ids_;
  std::vector<std::string> names_;
};

/// Values that only the machine's state knows: #5420.. and #<_x> and its kind.
class StateValues {
 public:
  virtual ~StateValues() = default;
  /// Index in `predefined_names()`.
  virtual double predefined(int index) const = 0;
  /// Program coordinate of X Y Z A B C (0..5).
  virtual double position(int axis) const = 0;
};

/// Names of the predefined read-only parameters, each with its leading underscore.
std::span<const std::string_view> predefined_names();
/// Index in predefined_names(), or -1.
int find_predefined(std::string_view name);

/// A parameter that may have been changed, as it was before.
struct ParameterChange {
  enum class Scope : std::uint8_t { kNumber, kGlobal, kLocal };
  Scope scope = Scope::kNumber;
  std::int32_t id = 0;  ///< its number, or that of its name
  double before = 0;
  bool known = true;  ///< a name that was not known before has no value
};

/// All parameters of a program: numbered, global named, and local named ones per sub-program call.
class Parameters {
 public:
  Parameters();

  double& operator[](int number) {
    touched_ |= number > parameter::kLocalCount;
    if (numbers_noted_[static_cast<std::size_t>(number)] != note_) note_number(number);
    return numbered_[static_cast<std::size_t>(number)];
  }
  double operator[](int number) const { return numbered_[static_cast<std::size_t>(number)]; }
  static bool is_read_only(int number) {
    return (number >= parameter::kTool && number <= 5413) ||
           (number >= parameter::kPosition && number <= 5428);
  }

  /// Whether a parameter that outlives its sub-program may have been changed since this was last asked.
  bool take_touched() { return std::exchange(touched_, false); }
  /// Values of #first to #last.
  std::span<const double> values(int first, int last) const {
    return std::span(numbered_).subspan(static_cast<std::size_t>(first),
                                        static_cast<std::size_t>(last - first + 1));
  }

  const double* local(std::int32_t id) const { return frames_[depth_].find(id); }
  const double* global(std::int32_t id) const { return globals_.find(id); }
  void set_local(std::int32_t id, double value) {
    if (depth_ == 0) note_name(ParameterChange::Scope::kLocal, id);
    frames_[depth_].set(id, value);
  }
  void set_global(std::int32_t id, double value) {
    note_name(ParameterChange::Scope::kGlobal, id);
    globals_.set(id, value);
  }

  /// A sub-program's frame: #1..#30 become the arguments (0 where none is given), names start unknown.
  void push_frame(std::span<const double> arguments);
  void pop_frame();
  std::size_t depth() const { return depth_; }

  /// What may have been changed since this was last asked, each once; without what belongs to a sub-program's
  /// call and ends with it.
  std::vector<ParameterChange> take_changes();
  /// As it was before `changes`; outside of sub-programs.
  void take_back(std::span<const ParameterChange> changes);
  /// A program was given up: its sub-programs are left, and what belongs to their calls is forgotten.
  void leave_sub_programs();

  /// Every parameter outside of sub-programs has the same value.
  bool same_values(const Parameters& other) const {
    return numbered_ == other.numbered_ && globals_ == other.globals_ && frames_[0] == other.frames_[0];
  }

  /// Names of the named parameters, global and local.
  NameTable& names() { return names_; }
  const NameTable& names() const { return names_; }

 private:
  struct Named {
    std::vector<double> value;
    std::vector<bool> known;
    const double* find(std::int32_t id) const {
      const auto i = static_cast<std::size_t>(id);
      return i < known.size() && known[i] ? &value[i] : nullptr;
    }
    void set(std::int32_t id, double v);
    void forget(std::int32_t id) { known[static_cast<std::size_t>(id)] = false; }
    void clear() { known.assign(known.size(), false); }
    std::array<double, parameter::kLocalCount> caller_locals{};

    bool operator==(const Named&) const = default;
  };
  void note_number(int number);
  void note_name(ParameterChange::Scope scope, std::int32_t id);

  NameTable names_;
  std::vector<double> numbered_;
  std::vector<ParameterChange> changes_;
  std::uint32_t note_ = 1;                                   ///< marks what is in changes_
  std::vector<std::uint32_t> numbers_noted_;                 ///< by number
  std::vector<std::uint32_t> globals_noted_, locals_noted_;  ///< by name
  bool touched_ = false;
  Named globals_;
  std::vector<Named> frames_;
  std::size_t depth_ = 0;
};

}  // namespace trn
