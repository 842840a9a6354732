#include "app/lab/workspace.h"

#include <fmt/format.h>
#include <unistd.h>

#include <cstdio>
#include <nlohmann/json.hpp>

#include "app/cli/commands.h"
#include "app/cli/named_files.h"
#include "app/lab/text_file.h"
#include "app/lab/workspace_svg.h"
#include "app/session/assembly.h"
#include "core/frames.h"
#include "core/units.h"

namespace trn {

namespace {

using Json = nlohmann::ordered_json;

struct WorkspaceFiles {
  std::string machine, csv, svg;
  bool json = false;
  WorkspaceOptions options;
};

constexpr const char kWorkspaceFooter[] =
    "Places are tool tips in the table frame, at the points of a grid; the box ends at the last one "
    "reached.\n"
    "A tilt counts as reached if the tool can lean that way in all directions the machine has.\n"
    "Conditioning: least over greatest singular value of the joints' speeds by tip and tool axis (100 mm to\n"
    "the radian); 0 is singular, and a five-axis machine is, upright.\n"
    "Speed gain: mm/s of the fastest linear joint per mm/s of the tip. Values are those of the worst "
    "direction.\n"
    "Example: trunnion workspace --machine hexapod --svg hexapod.svg --csv hexapod.csv\n";

/// What a survey says of one tilt.
struct TiltSummary {
  std::size_t reached = 0, sampled = 0;
  Vec3 min_B = Vec3::Zero(), max_B = Vec3::Zero();
  double conditioning_min = 0, speed_gain_max = 0, feed_mm_s_min = 0, turn_deg_s_min = 0;
};

TiltSummary summary_of(const Workspace& w, std::size_t tilt) {
  TiltSummary out;
  Eigen::AlignedBox3d box;
  for (int z = 0; z < w.count[2]; ++z)
    for (int y = 0; y < w.count[1]; ++y)
      for (int x = 0; x < w.count[0]; ++x) {
        const WorkspaceValue& v = w.values[w.index(tilt, x, y, z)];
        ++out.sampled;
        if (v.reach != Reach::kOk) continue;
        const bool first = out.reached++ == 0;
        box.extend(w.point(x, y, z));
        const double turn = deg_from_rad(v.turn_rad_s_max);
        out.conditioning_min = first ? v.conditioning : std::min(out.conditioning_min, v.conditioning);
        out.speed_gain_max = std::max(out.speed_gain_max, v.speed_gain);
        out.feed_mm_s_min = first ? v.feed_mm_s_max : std::min(out.feed_mm_s_min, v.feed_mm_s_max);
        out.turn_deg_s_min = first ? turn : std::min(out.turn_deg_s_min, turn);
      }
  if (out.reached > 0) {
    out.min_B = box.min();
    out.max_B = box.max();
  }
  return out;
}

std::string table_of(const Workspace& w) {
  std::string out = fmt::format("grid {} x {} x {}, {:.3g} mm apart; tip in the table frame\n", w.count[0],
                                w.count[1], w.count[2], w.step_mm);
  out += fmt::format("{:>8} {:>9}  {:<36} {:>12} {:>11} {:>11} {:>11}\n", "tilt deg", "litres",
                     "box reached, mm", "conditioning", "speed gain", "feed mm/s", "turn deg/s");
  for (std::size_t tilt = 0; tilt < w.tilts_deg.size(); ++tilt) {
    const TiltSummary s = summary_of(w, tilt);
    if (s.reached == 0) {
      out += fmt::format("{:>8g} {:>9}\n", w.tilts_deg[tilt], "none");
      continue;
    }
    const std::string box = fmt::format("X {:.0f}..{:.0f} Y {:.0f}..{:.0f} Z {:.0f}..{:.0f}", s.min_B.x(),
                                        s.max_B.x(), s.min_B.y(), s.max_B.y(), s.min_B.z(), s.max_B.z());
    out += fmt::format("{:>8g} {:>9.3g}  {:<36} {:>12.3g} {:>11.3g} {:>11.4g} {:>11.3g}\n", w.tilts_deg[tilt],
                       static_cast<double>(s.reached) * std::pow(w.step_mm, 3) * 1e-6, box,
                       s.conditioning_min, s.speed_gain_max, s.feed_mm_s_min, s.turn_deg_s_min);
  }
  out += "box: of the grid points reached; the space ends less than a step beyond\n";
  return out + "conditioning, feed and turn: the least, speed gain: the greatest of all places reached\n";
}

std::string json_of(const Workspace& w) {
  Json tilts = Json::array();
  for (std::size_t tilt = 0; tilt < w.tilts_deg.size(); ++tilt) {
    const TiltSummary s = summary_of(w, tilt);
    tilts.push_back({{"tilt_deg", w.tilts_deg[tilt]},
                     {"reached", s.reached},
                     {"sampled", s.sampled},
                     {"min_mm", {s.min_B.x(), s.min_B.y(), s.min_B.z()}},
                     {"max_mm", {s.max_B.x(), s.max_B.y(), s.max_B.z()}},
                     {"conditioning_min", s.conditioning_min},
                     {"speed_gain_max", s.speed_gain_max},
                     {"feed_mm_s_min", s.feed_mm_s_min},
                     {"turn_deg_s_min", s.turn_deg_s_min}});
  }
  const Json out{{"step_mm", w.step_mm}, {"tilts", tilts}};
  return out.dump(2) + "\n";
}

Exit workspace_command(const WorkspaceFiles& files) {
  const Assembly assembly = assemble(files.machine);
  check_text_file(files.csv);
  check_text_file(files.svg);
  const bool terminal = isatty(STDERR_FILENO) != 0;
  const auto progress = [&](double share) {
    if (terminal) fmt::print(stderr, "\r{:3.0f} %", 100 * share);
  };
  const Workspace workspace =
      survey_workspace(assembly.machine, *assembly.kinematics, *assembly.map, files.options, progress);
  if (terminal) fmt::print(stderr, "\r\033[K");
  if (!files.csv.empty()) write_text_file(files.csv, workspace_csv(workspace));
  if (!files.svg.empty())
    write_text_file(files.svg,
                    workspace_svg(workspace, fmt::format("Workspace of {}", assembly.machine.name)));
  fmt::print("{}", files.json ? json_of(workspace) : table_of(workspace));
  return Exit::kDone;
}

}  // namespace

void add_workspace(CLI::App& app, Exit& exit) {
  auto files = std::make_shared<WorkspaceFiles>();
  CLI::App* command = app.add_subcommand(
      "workspace", "Tell what a machine reaches, how fast, and how well conditioned it is there");
  command->add_option("--machine,-m", files->machine, kMachineOption)->required();
  command->add_option("--svg", files->svg, "write a picture: sections through home");
  command->add_option("--csv", files->csv, "write every place sampled");
  command->add_option("--tool-length", files->options.tool_length_mm, "mm from gauge point to tip")
      ->capture_default_str();
  command->add_option("--points", files->options.points, "grid points along the longest side")
      ->check(CLI::Range(3, 200))
      ->capture_default_str();
  command->add_option("--tilts", files->options.tilts_deg, "tilts to try, deg")
      ->check(CLI::Range(0.0, 180.0))
      ->capture_default_str();
  command->add_flag("--json", files->json, "the table as JSON");
  command->footer(kWorkspaceFooter);
  command->callback([files, &exit] { exit = workspace_command(*files); });
}

}  // namespace trn
