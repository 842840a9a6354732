#pragma once

#include <string>
#include <string_view>

namespace trn {

// The reference pages of docs/ are Markdown. What follows finds one name's part in such a page and turns it
// into plain text, so that `trunnion help NAME` says what the page says.

/// What a page tells of a code, as "G83": the paragraph that has it in bold type, else the first part or row
/// of a table that has it, with the examples there. "" if the page does not have it.
std::string code_in_page(std::string_view page, std::string_view code);

/// The rows of a page's tables whose first cell is this name, each below its heading, with a line for each
/// column. Case does not count. "table.name" is the name in the table that stands as `[table]` or `[[table]]`
/// above the rows. "" if there is none.
std::string rows_in_page(std::string_view page, std::string_view name);

}  // namespace trn
