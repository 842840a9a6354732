#include "app/cli/reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <charconv>
#include <vector>

#include "app/cli/help_formatter.h"
#include "core/letter_case.h"

namespace trn {

namespace {

using PageLines = std::vector<std::string_view>;

PageLines split_text(std::string_view text, std::string_view at) {
  PageLines out;
  for (std::size_t end = 0; end != std::string_view::npos; text.remove_prefix(end + at.size())) {
    end = text.find(at);
    out.push_back(text.substr(0, end));
    if (end == std::string_view::npos) break;
  }
  return out;
}

std::string_view trimmed_cell(std::string_view text) {
  const std::size_t begin = std::min(text.find_first_not_of(' '), text.size());
  return text.substr(begin, text.find_last_not_of(' ') + 1 - begin);
}

/// A piece of a page with one subject.
struct PagePart {
  std::string heading;
  PageLines lines;
};

bool is_heading(std::string_view line) { return line.starts_with("## ") || line.starts_with("### "); }
bool is_row(std::string_view line) { return line.starts_with("| "); }
bool is_fence(std::string_view line) { return line.starts_with("```"); }

// A heading begins a part, and so does a paragraph that begins in bold type. What stands above the first
// heading speaks of the whole page.
std::vector<PagePart> parts_of(std::string_view page) {
  std::vector<PagePart> out;
  bool in_code = false, after_gap = false;
  for (const std::string_view line : split_text(page, "\n")) {
    if (is_fence(line)) in_code = !in_code;
    const bool heads = !in_code && is_heading(line);
    if (heads)
      out.push_back({std::string(line.substr(line.find(' ') + 1)), {}});
    else if (!out.empty() && !in_code && after_gap && line.starts_with("**"))
      out.push_back({out.back().heading, {}});
    if (!heads && !out.empty()) out.back().lines.push_back(line);
    after_gap = line.empty();
  }
  return out;
}

bool is_digit_char(char c) { return std::isdigit(static_cast<unsigned char>(c)) != 0; }

// "G1" stands in "G1 X5" and "N5G1", not in "G10" or "G1.5".
bool has_code(std::string_view text, std::string_view code) {
  for (std::size_t at = text.find(code); at != std::string_view::npos; at = text.find(code, at + 1)) {
    const std::string_view after = text.substr(at + code.size());
    const bool longer = !after.empty() && (is_digit_char(after[0]) ||
                                           (after[0] == '.' && after.size() > 1 && is_digit_char(after[1])));
    const bool inside = at > 0 && std::isalpha(static_cast<unsigned char>(text[at - 1]));
    if (!longer && !inside) return true;
  }
  return false;
}

// Tenths of the number of a code, "G59.1" -> 591; -1 if it is none.
int code_tenths(std::string_view code) {
  double number = -1;
  if (code.size() < 2) return -1;
  const auto read = std::from_chars(code.data() + 1, code.data() + code.size(), number);
  return read.ptr == code.data() + code.size() ? static_cast<int>(number * 10 + 0.5) : -1;
}

// "**G54** to **G59**" names all between: those without a decimal, or all tenths if the first one has one.
bool is_between(std::string_view first, std::string_view last, std::string_view code) {
  const int from = code_tenths(first), to = code_tenths(last), number = code_tenths(code);
  if (from < 0 || to < 0 || first[0] != code[0]) return false;
  return from < number && number < to && (from % 10 != 0) == (number % 10 != 0);
}

bool is_named(std::string_view line, std::string_view code) {
  const PageLines pieces = split_text(line, "**");  // every second one is in bold type
  for (std::size_t i = 1; i + 1 < pieces.size(); i += 2) {
    if (has_code(pieces[i], code)) return true;
    if (i + 2 < pieces.size() && pieces[i + 1] == " to " && is_between(pieces[i], pieces[i + 2], code))
      return true;
  }
  return false;
}

// Of a table only the rows of the code, where it has some. Where nothing else speaks of it, nothing else.
PageLines with_rows_of(const PageLines& lines, std::string_view code) {
  const auto speaks = [&](std::string_view line) {
    return has_code(line, code) && !line.starts_with("<!--");
  };
  const auto any_speaks = [&](bool rows) {
    return std::any_of(lines.begin(), lines.end(),
                       [&](std::string_view line) { return is_row(line) == rows && speaks(line); });
  };
  if (!any_speaks(true)) return lines;
  const bool only_rows = !any_speaks(false);
  PageLines out;
  for (const std::string_view line : lines)
    if (line.starts_with("|") ? speaks(line) : !only_rows) out.push_back(line);
  return out;
}

// Without the marks of Markdown: bold type, code and links.
std::string plain_line(std::string_view line) {
  std::string out;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line.substr(i).starts_with("**")) {
      ++i;
    } else if (line[i] == '[') {
      const std::size_t end = line.find("](", i),
                        close = end == std::string_view::npos ? end : line.find(')', end);
      if (close == std::string_view::npos || line.find(']', i) != end) {
        out += '[';
        continue;
      }
      out += plain_line(line.substr(i + 1, end - i - 1));
      i = close;
    } else if (line[i] == '\\' && i + 1 < line.size() && line[i + 1] == '|') {
      continue;
    } else if (line[i] != '`') {
      out += line[i];
    }
  }
  return out;
}

PageLines cells_of(std::string_view row) {
  PageLines out;
  for (const std::string_view cell : split_text(row.substr(1, row.rfind('|') - 1), " | "))
    out.push_back(trimmed_cell(cell));
  return out;
}

std::string plain_row(std::string_view row) {
  std::string out;
  for (const std::string_view cell : cells_of(row)) {
    if (cell.empty()) continue;
    out += out.empty() ? "" : ": ";
    out += plain_line(cell);
  }
  return out;
}

// Paragraphs in lines that fit, and examples as they stand.
std::string plain_text(const PageLines& lines) {
  std::string out, paragraph;
  bool in_code = false;
  const auto end_paragraph = [&] {
    if (!paragraph.empty()) out += wrapped(paragraph, 0) + "\n";
    paragraph.clear();
  };
  for (const std::string_view line : lines) {
    const bool begins = is_fence(line) || is_row(line) || line.starts_with("- ") || line.empty();
    if (begins || in_code) end_paragraph();
    if (is_fence(line)) {
      in_code = !in_code;
    } else if (in_code) {
      out += line.empty() ? "\n" : fmt::format("    {}\n", line);
    } else if (line.starts_with("<!--") || line.starts_with("|---") || line == "| | |") {
      continue;
    } else if (is_row(line)) {
      out += "  " + wrapped(plain_row(line), 2) + "\n";
    } else if (!line.empty()) {
      paragraph += (paragraph.empty() ? "" : " ") + plain_line(trimmed_cell(line));
    } else if (!out.empty() && !out.ends_with("\n\n")) {
      out += '\n';
    }
  }
  end_paragraph();
  while (out.ends_with("\n\n")) out.pop_back();
  return out;
}

// "`a_mm`<br>`a_deg`" and "CANopen, CiA 402" have two names each.
bool is_first_cell(std::string_view cell, const std::string& name) {
  for (const std::string_view line : split_text(cell, "<br>"))
    for (const std::string_view one : split_text(line, ", "))
      if (lower_case(plain_line(one)) == name) return true;
  return false;
}

std::string plain_cell(std::string_view cell) {
  return plain_line(CLI::detail::find_and_replace(std::string(cell), "<br>", ", "));
}

// "`[[joint]]`, required. ..." -> "[[joint]]", with all tables and their types where there are more.
std::string tables_of(std::string_view about) {
  std::string out = plain_line(about.substr(0, about.find(". ")));
  if (out.ends_with('.')) out.pop_back();
  for (const char* word : {", required", ", optional"}) out = CLI::detail::find_and_replace(out, word, "");
  return out;
}

}  // namespace

std::string code_in_page(std::string_view page, std::string_view code) {
  const std::vector<PagePart> parts = parts_of(page);
  const auto any_line = [&](auto&& speaks) {
    return std::find_if(parts.begin(), parts.end(), [&](const PagePart& part) {
      return std::any_of(part.lines.begin(), part.lines.end(), speaks);
    });
  };
  auto found = any_line([&](std::string_view line) { return is_named(line, code); });
  const bool named = found != parts.end();
  if (!named)
    found =
        any_line([&](std::string_view line) { return !line.starts_with("<!--") && has_code(line, code); });
  if (found == parts.end()) return "";
  return fmt::format("{}\n\n{}", found->heading,
                     plain_text(named ? found->lines : with_rows_of(found->lines, code)));
}

std::string rows_in_page(std::string_view page, std::string_view name) {
  const std::string small = lower_case(name);
  const std::size_t dot = small.rfind('.');
  const std::string table = dot == std::string::npos ? "" : fmt::format("[{}]", small.substr(0, dot));
  const std::string key = dot == std::string::npos ? small : small.substr(dot + 1);
  std::string out, heading, about;
  PageLines columns;
  std::string_view before;
  for (const std::string_view line : split_text(page, "\n")) {
    if (line.starts_with("|---")) columns = cells_of(before);
    if (line.starts_with("#")) heading = line.substr(line.find(' ') + 1), about.clear();
    if (!line.empty() && !line.starts_with("|") && !line.starts_with("#")) about = line;
    before = line;
    if (!is_row(line) || (!table.empty() && about.find(table) == std::string::npos)) continue;
    const PageLines cells = cells_of(line);
    if (!is_first_cell(cells[0], key)) continue;
    const std::string names = plain_cell(cells[0]);
    out += out.empty() ? "" : "\n";
    out += about.starts_with("`[") ? wrapped(fmt::format("{}, a key of {}", names, tables_of(about)), 4)
                                   : fmt::format("{}: {}", heading, names);
    out += '\n';
    for (std::size_t i = 1; i < cells.size() && i < columns.size(); ++i) {
      const bool only_one = columns.size() == 2;
      const std::string text = plain_cell(cells[i]);
      if (!text.empty())
        out += fmt::format("  {}\n",
                           only_one ? wrapped(text, 2) : wrapped(fmt::format("{}: {}", columns[i], text), 4));
    }
  }
  return out;
}

}  // namespace trn
