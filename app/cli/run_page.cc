#include "app/cli/run_page.h"

#include <fmt/format.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string_view>
#include <system_error>

#include "app/cli/kinematics_json.h"
#include "app/cli/panel_page.h"
#include "app/lab/plan_preview.h"
#include "app/lab/text_file.h"
#include "panel/server/machine_json.h"

namespace trn {

namespace {

std::string content_of(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

// RFC 4648, 4.
std::string base64(std::string_view bytes) {
  constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (i + k < bytes.size() ? static_cast<unsigned char>(bytes[i + k]) : 0U);
    for (int k = 0; k < 4; ++k) out += kDigits[three >> (18 - 6 * k) & 63U];
  }
  for (std::size_t k = 0; k < (3 - bytes.size() % 3) % 3; ++k) out[out.size() - 1 - k] = '=';
  return out;
}

// What stands between the tags of a script must not end it.
std::string replaced(std::string text, std::string_view what, std::string_view by) {
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + by.size()))
    text.replace(at, what.size(), by);
  return text;
}

std::string plan_text(const std::string& folder, const PlanPreview& plan, const Machine& machine,
                      const std::string& program) {
  const std::string path = folder + "/.path.plan";
  write_plan(path, plan, machine, program);
  std::string text = base64(content_of(path));
  std::error_code none;
  std::filesystem::remove(path, none);
  return text;
}

}  // namespace

bool write_run_page(const std::string& folder, const std::string& program, const Machine& machine,
                    const PlanPreview& plan) {
  const std::string page = find_panel_page("");
  const std::string script = content_of(page + "/report.js"), style = content_of(page + "/report.css");
  if (page.empty() || script.empty() || style.empty()) return false;
  const nlohmann::json run{
      {"program", program},
      {"text", content_of(program)},
      {"plan", plan_text(folder, plan, machine, program)},
      {"machine", machine_json(machine, TRN_VERSION, "", "", kinematics_json(machine), {}, {})}};
  const std::string told =
      replaced(run.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace), "<", "\\u003c");
  write_text_file(folder + "/path.html",
                  fmt::format("<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
                              "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
                              "<title>{}</title>\n<style>{}</style></head>\n<body><div id=\"page\"></div>\n"
                              "<script type=\"application/json\" id=\"trunnion\">{}</script>\n"
                              "<script>{}</script></body></html>\n",
                              replaced(replaced(program, "&", "&amp;"), "<", "&lt;"), style, told,
                              replaced(script, "</script", "<\\/script")));
  return true;
}

}  // namespace trn
