#include "interp/gcode/parameters.h"

#include <algorithm>

#include "core/check.h"

namespace trn {

namespace {

// The order is that of Executor::predefined.
constexpr std::array<std::string_view, 62> kPredefined = {"_vmajor",
                                                          "_vminor",
                                                          "_line",
                                                          "_motion_mode",
                                                          "_plane",
                                                          "_ccomp",
                                                          "_metric",
                                                          "_imperial",
                                                          "_absolute",
                                                          "_incremental",
                                                          "_inverse_time",
                                                          "_units_per_minute",
                                                          "_units_per_rev",
                                                          "_coord_system",
                                                          "_tool_offset",
                                                          "_retract_r_plane",
                                                          "_retract_old_z",
                                                          "_spindle_rpm_mode",
                                                          "_spindle_css_mode",
                                                          "_ijk_absolute_mode",
                                                          "_lathe_diameter_mode",
                                                          "_lathe_radius_mode",
                                                          "_spindle_on",
                                                          "_spindle_cw",
                                                          "_mist",
                                                          "_flood",
                                                          "_speed_override",
                                                          "_feed_override",
                                                          "_adaptive_feed",
                                                          "_feed_hold",
                                                          "_feed",
                                                          "_rpm",
                                                          "_x",
                                                          "_y",
                                                          "_z",
                                                          "_a",
                                                          "_b",
                                                          "_c",
                                                          "_abs_x",
                                                          "_abs_y",
                                                          "_abs_z",
                                                          "_abs_a",
                                                          "_abs_b",
                                                          "_abs_c",
                                                          "_current_tool",
                                                          "_current_pocket",
                                                          "_selected_tool",
                                                          "_selected_pocket",
                                                          "_call_level",
                                                          "_value",
                                                          "_value_returned",
                                                          "_task",
                                                          "_remap_level",
                                                          "_tool_diameter",
                                                          "_tool_length",
                                                          "_rtcp",
                                                          "_tilted_plane",
                                                          "_u",
                                                          "_v",
                                                          "_w",
                                                          "_block_delete",
                                                          "_optional_stop"};

}  // namespace

std::span<const std::string_view> predefined_names() { return kPredefined; }

int find_predefined(std::string_view name) {
  const auto found = std::find(kPredefined.begin(), kPredefined.end(), name);
  return found == kPredefined.end() ? -1 : static_cast<int>(found - kPredefined.begin());
}

std::int32_t NameTable::intern(std::string_view name) {
  const auto found = ids_.find(name);
  if (found != ids_.end()) return found->second;
  const auto id = static_cast<std::int32_t>(names_.size());
  names_.emplace_back(name);
  ids_.emplace(std::string(name), id);
  TRN_CHECK(ids_.size() == names_.size());
  return id;
}

void Parameters::Named::set(std::int32_t id, double v) {
  TRN_CHECK(id >= 0);
  TRN_CHECK(known.size() == value.size());
  const auto i = static_cast<std::size_t>(id);
  if (i >= known.size()) {
    known.resize(i + 1, false);
    value.resize(i + 1, 0.0);
  }
  known[i] = true;
  value[i] = v;
}

Parameters::Parameters()
    : numbered_(parameter::kMax + 1, 0.0), numbers_noted_(parameter::kMax + 1, 0), frames_(1) {
  numbered_[parameter::kSystem] = 1;
  numbered_[parameter::kDebugOutput] = 1;
}

// #1 to #30 within a call are put back by the return from it.
void Parameters::note_number(int number) {
  if (number <= parameter::kLocalCount && depth_ > 0) return;
  numbers_noted_[static_cast<std::size_t>(number)] = note_;
  changes_.push_back({ParameterChange::Scope::kNumber, number, numbered_[static_cast<std::size_t>(number)]});
}

void Parameters::note_name(ParameterChange::Scope scope, std::int32_t id) {
  const bool global = scope == ParameterChange::Scope::kGlobal;
  std::vector<std::uint32_t>& noted = global ? globals_noted_ : locals_noted_;
  const auto i = static_cast<std::size_t>(id);
  if (i >= noted.size()) noted.resize(i + 1, 0);
  if (noted[i] == note_) return;
  noted[i] = note_;
  const double* const before = (global ? globals_ : frames_[0]).find(id);
  changes_.push_back({scope, id, before ? *before : 0, before != nullptr});
}

std::vector<ParameterChange> Parameters::take_changes() {
  ++note_;
  return std::exchange(changes_, {});
}

void Parameters::take_back(std::span<const ParameterChange> changes) {
  TRN_CHECK(depth_ == 0);
  touched_ |= !changes.empty();
  for (const ParameterChange& change : changes) {
    Named& names = change.scope == ParameterChange::Scope::kGlobal ? globals_ : frames_[0];
    if (change.scope == ParameterChange::Scope::kNumber)
      numbered_[static_cast<std::size_t>(change.id)] = change.before;
    else if (change.known)
      names.set(change.id, change.before);
    else
      names.forget(change.id);
  }
}

void Parameters::leave_sub_programs() {
  while (depth_ > 0) pop_frame();
}

void Parameters::push_frame(std::span<const double> arguments) {
  TRN_CHECK(arguments.size() <= parameter::kLocalCount);
  ++depth_;
  if (frames_.size() <= depth_) frames_.resize(depth_ + 1);
  Named& frame = frames_[depth_];
  // Frames are used again and keep their memory: a sub-program that is called a million times allocates once.
  frame.clear();
  // #1 to #30 belong to the call. The caller's are put aside, so that every access to a number goes to one
  // and the same place.
  std::copy_n(numbered_.begin() + 1, parameter::kLocalCount, frame.caller_locals.begin());
  std::fill_n(numbered_.begin() + 1, parameter::kLocalCount, 0.0);
  std::copy(arguments.begin(), arguments.end(), numbered_.begin() + 1);
}

void Parameters::pop_frame() {
  TRN_CHECK(depth_ > 0 && depth_ < frames_.size());
  const Named& frame = frames_[depth_];
  std::copy(frame.caller_locals.begin(), frame.caller_locals.end(), numbered_.begin() + 1);
  --depth_;
}

}  // namespace trn
