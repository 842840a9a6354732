#include "app/cli/fault_rows.h"

#include <fmt/format.h>

#include <cstdio>

#include "core/config.h"
#include "core/fault.h"

namespace trn {

namespace {

std::string_view reaction_text(Reaction reaction) {
  static constexpr std::string_view kNames[] = {"none", "path stop", "quick stop"};
  static_assert(std::size(kNames) == static_cast<std::size_t>(Reaction::kQuickStop) + 1);
  return kNames[static_cast<std::size_t>(reaction)];
}

}  // namespace

nlohmann::ordered_json json_of(const RehearsedFault& row) {
  return {{"cause", row.cause},
          {"fault", fault_info(row.fault).name},
          {"reaction", reaction_text(fault_info(row.fault).reaction)},
          {"periods_to_fault", row.to_fault},
          {"periods_to_rest", row.to_rest},
          {"crept", row.crept},
          {"position_kept", row.kept_position},
          {"periods_to_recover", row.to_recover},
          {"message", row.message},
          {"good", row.good()}};
}

void print_fault_row(const RehearsedFault& row) {
  const std::string to_fault = row.to_fault < 0 ? "-" : std::to_string(row.to_fault);
  fmt::print("{:<38} {:<16} {:<11} {:>5} {:>6} {:>8.1g}  {:<5} {:>7}  {}\n", row.cause,
             fault_info(row.fault).name, reaction_text(fault_info(row.fault).reaction), to_fault, row.to_rest,
             row.crept, row.kept_position ? "yes" : "lost", row.to_recover,
             row.good() ? "" : "NOT AS IT SHOULD");
  if (!row.message.empty()) fmt::print("    {}\n", row.message);
  std::fflush(stdout);
}

void print_fault_header() {
  fmt::print("{:<38} {:<16} {:<11} {:>5} {:>6} {:>8}  {:<5} {:>7}\n", "cause, in the middle of a motion",
             "fault", "reaction", "fault", "rest", "creeps", "place", "recover");
}

}  // namespace trn
