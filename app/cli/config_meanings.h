#pragma once

#include <string_view>
#include <vector>

namespace trn {

/// Where the keys of a section are legal: a table, and the `type` that it, or the nearest table around it
/// that has one, must have. Type "*": any.
struct ConfigPlace {
  std::string_view table;  ///< "drives.node"
  std::string_view kind;   ///< "canopen"; "" where no table around it has a type
};

/// What a key is for. Form, unit, range and default are the readers'; what they cannot know is said here.
struct KeyMeaning {
  std::string_view keys;  ///< one, or several that mean the same in other units or axes: "min_mm min_deg"
  std::string_view meaning;
  /// The default in words. Needed where it follows from other keys or the key is required only at times.
  std::string_view fallback = "";
  /// What is legal in words. Needed where the range or the choices follow from other keys.
  std::string_view legal = "";
};

/// A table of the page, with the keys in the order in which a person writes them.
struct SectionMeaning {
  std::string_view title;  ///< "" where the chapter has one section only
  std::vector<ConfigPlace> places;
  std::string_view intro;
  std::vector<KeyMeaning> keys;
};

struct ChapterMeaning {
  std::string_view title, intro;
  std::vector<SectionMeaning> sections;
};

// The list that `trunnion config --keys` checks against the readers: a key without a meaning, and a meaning
// without a key, are told as errors.
extern const ChapterMeaning kMachineMeanings, kKinematicsMeanings, kProgramMeanings, kPlannerMeanings,
    kCorrectionMeanings, kDriveMeanings, kCanMeanings, kSlowDriveMeanings, kIoMeanings, kModbusMeanings,
    kSafetyMeanings, kSignalMeanings, kDrawingMeanings, kHostMeanings, kOtherFileMeanings;

/// In the order of the page.
std::vector<const ChapterMeaning*> all_meanings();

}  // namespace trn
