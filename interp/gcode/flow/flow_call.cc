#include <fmt/format.h>

#include <array>
#include <cmath>
#include <filesystem>

#include "core/check.h"
#include "interp/gcode/error.h"
#include "interp/gcode/flow/flow.h"
#include "interp/gcode/modal.h"
#include "interp/gcode/program_config.h"
#include "interp/gcode/text/block.h"
#include "interp/gcode/text/line_reader.h"

// Sub-programs: calls by number, by name and from files; M98 and M99.
namespace trn {

void Flow::call(const ParsedBlock& block, std::int32_t label) {
  std::array<double, parameter::kLocalCount> arguments{};
  const std::size_t count = block.flow.arguments.size();
  TRN_CHECK(count <= arguments.size());
  // All arguments before the frame is changed: "o1 call [#1 + #2]" means the caller's #1.
  for (std::size_t i = 0; i < count; ++i) arguments[i] = argument(block, i);
  enter(label, std::span(arguments.data(), count), false, 0);
}

// The return place is kept before the sub-program is looked for, since that may move the reader and open
// files. O calls have a frame of parameters of their own (#1 to #30); M98 shares those of its caller, as
// other controls have it.
void Flow::enter(std::int32_t label, std::span<const double> arguments, bool numbered, std::int64_t repeats) {
  if (frames_.size() >= static_cast<std::size_t>(config_.sub_depth_max))
    fail(GcodeErrorCode::kSubDepth, 1, config_.sub_depth_max);
  const Frame back{label,         next_,       next_node_, current_.at.line, current_.file,
                   loops_.size(), ifs_.size(), numbered,   repeats,          {},
                   false,         {}};
  CodePlace place;
  if (!find_sub(label, place)) {
    go(back.back, back.back_node);
    fail(GcodeErrorCode::kSubUnknown, 1, "o" + labels_.name(label));
  }
  frames_.push_back(back);
  frames_.back().start = place;
  TRN_CHECK(frames_.size() <= static_cast<std::size_t>(config_.sub_depth_max));
  TRN_CHECK(place.file >= 0 && static_cast<std::size_t>(place.file) < files_.size());
  if (!numbered) parameters_.push_frame(arguments);
  executor_.set_call_level(static_cast<int>(frames_.size()));
  go(place);
}

// endsub, return and M99. M98 with L comes back here L times before it goes on behind the call.
void Flow::leave(const ParsedBlock* with_value) {
  TRN_CHECK(!frames_.empty());
  Frame& frame = frames_.back();
  if (frame.numbered && --frame.repeats_left > 0) return go(frame.start);
  if (!frame.numbered) {
    const bool returns = with_value && !with_value->flow.arguments.empty();
    executor_.set_return_value(returns ? std::optional(argument(*with_value, 0)) : std::nullopt);
  }
  // Before the frame is popped: M73 restores what was kept at this level.
  executor_.on_return(static_cast<int>(frames_.size()));
  if (!frame.numbered) parameters_.pop_frame();
  TRN_CHECK(frame.loops <= loops_.size());
  loops_.resize(frame.loops, Loop{FlowKind::kNone, -1, {}, -1});
  ifs_.resize(std::min(ifs_.size(), frame.ifs));
  go(frame.back, frame.back_node);
  if (frame.between) current_ = frame.called;
  between_over_ = frame.between;
  frames_.pop_back();
  executor_.set_call_level(static_cast<int>(frames_.size()));
}

void Flow::call_numbered(const Block& block) {
  if (!block.has('P'))
    fail(GcodeErrorCode::kMissingWord, block.at(MGroup::kSub), "M98", "a P word, the sub-program");
  const double number = block['P'], repeats = block.get('L', 1);
  if (number != std::round(number) || number < 0)
    fail(GcodeErrorCode::kNotInteger, block.at('P'), 'P', number);
  if (repeats != std::round(repeats) || repeats < 0)
    fail(GcodeErrorCode::kNotInteger, block.at('L'), 'L', repeats);
  // L0 is a call that was switched off.
  if (repeats == 0) return;
  enter(labels_.intern(fmt::format("{:.0f}", number)), {}, true, static_cast<std::int64_t>(repeats));
}

void Flow::call_user(const Block& block) {
  for (const UserCode& user : config_.user_m) {
    if (user.code != block.code(MGroup::kUser) || user.call.empty()) continue;
    const std::array<double, 4> arguments{block.get('P', 0), block.get('Q', 0)};
    return enter(labels_.intern(user.call), arguments, false, 0);
  }
}

void Flow::call_between(const std::string& name, std::array<double, 4> arguments) {
  const CodePlace called = current_;
  enter(labels_.intern(name), arguments, false, 0);
  TRN_CHECK(!frames_.empty());
  frames_.back().between = true;
  frames_.back().called = called;
}

bool Flow::return_numbered(const Block& block) {
  if (!frames_.empty()) {
    leave(nullptr);
    return false;
  }
  if (config_.typed)
    fail(GcodeErrorCode::kNotSupported, block.at(MGroup::kSub), "M99 in a typed line",
         "what is typed runs once; M99 stands at the end of a program or a sub-program");
  if (!told_again_)
    executor_.warn(block.at(MGroup::kSub), "M99 in the main program: it begins again from its first line");
  told_again_ = true;
  begin_again();
  return true;
}

// A definition in the calling file, in the main program, or a file of its own on the path.
bool Flow::find_sub(std::int32_t label, CodePlace& place) {
  TRN_CHECK(label >= 0 && static_cast<std::size_t>(current_.file) < files_.size());
  const std::string name = labels_.name(label);  // a copy: indexing may add labels
  // The nearest definition counts: that of the file which calls, then the main program's, then those of files
  // that are open, and only then a file of that name.
  for (const int index : {current_.file, 0}) {
    File& f = *files_[static_cast<std::size_t>(index)];
    auto found = f.subs.find(label);
    if (found == f.subs.end() && !f.indexed) {
      index_file(static_cast<std::size_t>(index));
      found = f.subs.find(label);
    }
    if (found == f.subs.end()) continue;
    place = {index, found->second};
    return true;
  }
  for (std::size_t index = 1; index < files_.size(); ++index) {
    const auto found = files_[index]->subs.find(label);
    if (found == files_[index]->subs.end()) continue;
    place = {static_cast<int>(index), found->second};
    return true;
  }
  return open_sub_file(name, place, label);
}

// One pass over the file for every sub word (and bare O number), by place.
void Flow::index_file(std::size_t index) {
  TRN_CHECK(index < files_.size());
  File& f = *files_[index];
  f.indexed = true;
  const LinePlace here = f.reader->place();
  if (!f.reader->seek({0, 1})) fail(GcodeErrorCode::kNotSeekable, 1, "sub-programs");
  ParsedBlock block;
  std::string_view line;
  for (bool more = true; more;) {
    try {
      const std::uint32_t number = f.reader->place().line;
      more = f.reader->next(line);
      if (!more) break;
      parser_.parse_flow_only(line, block);
      const FlowKind kind = block.flow.kind;
      if ((kind != FlowKind::kSub && kind != FlowKind::kProgramNumber) || block.flow.label < 0) continue;
      const auto [at, fresh] = f.subs.emplace(block.flow.label, f.reader->place());
      if (!fresh && at->second.line != number + 1 && kind == FlowKind::kSub)
        fail(GcodeErrorCode::kSubRepeated, block.flow.column, "o" + labels_.name(block.flow.label),
             at->second.line - 1);
    } catch (const BlockError& error) {
      if (error.code == GcodeErrorCode::kSubRepeated) throw;
    }  // other errors are told when the line itself is reached
  }
  f.reader->seek(here);
  reader_there_ = false;
}

bool Flow::open_sub_file(const std::string& name, CodePlace& place, std::int32_t label) {
  namespace fs = std::filesystem;
  // A label is a name and no path: a program must not open what lies outside its folders.
  if (name.find('/') != std::string::npos || name.find("..") != std::string::npos) return false;
  for (const std::string& entry : config_.sub_path) {
    const fs::path folder =
        fs::path(entry).is_absolute() ? fs::path(entry) : fs::path(files_[0]->folder) / entry;
    for (const char* ending : {".ngc", ".nc", ""}) {
      const fs::path path = folder / (name + ending);
      std::unique_ptr<ByteSource> source = config_.open(path.string(), true);
      if (!source) continue;
      auto made = std::make_unique<File>();
      made->name = path.string();
      made->folder = folder.string();
      made->reader = std::make_unique<LineReader>(std::move(source), config_.line_length_max);
      files_.push_back(std::move(made));
      index_file(files_.size() - 1);
      const File& f = *files_.back();
      const auto found = f.subs.find(label);
      place = {static_cast<int>(files_.size()) - 1, found == f.subs.end() ? LinePlace{} : found->second};
      return true;
    }
  }
  return false;
}

}  // namespace trn
