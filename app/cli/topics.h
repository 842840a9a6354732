#pragma once

#include <string>

namespace trn {

/// What Trunnion's reference says of a name, for a terminal; "" if it does not have it. A name is a code of a
/// program ("G83"), a fault ("following_error"), a key of a machine's config ("jerk_mm_s3",
/// "joint.jerk_mm_s3") or a word of the glossary ("feed hold").
std::string topic_text(const std::string& name);

/// The pages docs/gcode.md, docs/faults.md and docs/glossary.md as they were when the program was built.
extern const char* const kGcodePage;
extern const char* const kFaultPage;
extern const char* const kGlossaryPage;

}  // namespace trn
