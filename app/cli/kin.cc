#include <fmt/format.h>

#include <cstdio>
#include <iostream>
#include <nlohmann/json.hpp>

#include "app/cli/commands.h"
#include "app/cli/kin_words.h"
#include "app/cli/named_files.h"
#include "app/session/corrections.h"
#include "compensation/rtcp.h"
#include "core/axes.h"
#include "core/config.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/motion.h"
#include "core/ports.h"
#include "core/units.h"
#include "kernel/joint_map.h"
#include "kinematics/factory.h"
#include "kinematics/machines/hexapod.h"
#include "kinematics/platform_kinematics.h"

namespace trn {

namespace {

using Json = nlohmann::ordered_json;

struct KinOptions {
  std::string machine;
  std::string direction;
  bool words = false;
};

constexpr const char kKinFooter[] =
    "One JSON object a line in, one a line out; mm and rad; p and u are tip and tool axis (from the tip "
    "towards\n"
    "the spindle) in the table frame. Blank lines are skipped.\n"
    "  forward   {\"q\":[...]}                  -> {\"p\":[x,y,z],\"u\":[i,j,k]}\n"
    "  inverse   {\"p\":[x,y,z],\"u\":[i,j,k]}    -> {\"q\":[...]}\n"
    "  setpoint  the same after all corrections, as the drives get it\n"
    "Optional: \"tool_length_mm\" (default 0); \"seed\":[...], the joints whose neighbour is wanted (default "
    "0).\n"
    "A machine with a moving platform gives, and inverse takes instead of p and u,\n"
    "\"platform\":{\"p\":[..],\"R\":[[..],[..],[..]]} in the base frame. It also gives \"conditioning\", "
    "from "
    "1 (every\n"
    "direction as stiff as any other) to 0 (singular), and a hexapod \"joint_angle_deg\" and "
    "\"leg_distance_mm\".\n"
    "With --words it speaks as a machinist does, mm and degrees, a line in and a line out:\n"
    "  forward   X=10 C=90   joints -> words, and where the tool is, seen from the work\n"
    "  inverse   X10 A30     words -> joints, and the same\n"
    "What a line leaves out is 0; on a platform that cannot stand there, it is where the platform's home has "
    "it.\n"
    "`kin words` needs no input: it says for every positive word which way the tool goes, to check `sense`.\n"
    "A pose that cannot be: {\"error\":\"unreachable|singular|limit\",\"message\":...}.\n"
    "A line that is not understood: {\"error\":\"bad_request\",\"line\":N,\"message\":...}.\n"
    "Exit: 0 every line was understood, 3 bad config, 5 usage or a bad request.\n";

/// A request that cannot be understood; what() says what would be right.
struct BadRequest : std::runtime_error {
  using std::runtime_error::runtime_error;
};

std::vector<double> numbers_at(const Json& request, const char* key, std::size_t count) {
  const auto found = request.find(key);
  if (found == request.end())
    throw BadRequest(fmt::format("missing \"{}\": an array of {} numbers", key, count));
  std::vector<double> out;
  for (const Json& value : *found)
    if (value.is_number()) out.push_back(value.get<double>());
  if (!found->is_array() || found->size() != count || out.size() != count)
    throw BadRequest(fmt::format("\"{}\" must be an array of {} numbers", key, count));
  return out;
}

Vec3 vec3_at(const Json& request, const char* key) {
  const std::vector<double> v = numbers_at(request, key, 3);
  return {v[0], v[1], v[2]};
}

JointVec joints_at(const Json& request, const char* key, int count) {
  const std::vector<double> v = numbers_at(request, key, static_cast<std::size_t>(count));
  return Eigen::Map<const Eigen::VectorXd>(v.data(), count);
}

void check_keys(const Json& request, const std::vector<std::string>& legal) {
  if (!request.is_object()) throw BadRequest("a request is a JSON object, as {\"q\":[0,0,0,0,0]}");
  for (const auto& [key, value] : request.items()) {
    if (std::find(legal.begin(), legal.end(), key) != legal.end()) continue;
    const std::string near = nearest_word(key, legal);
    throw BadRequest(near.empty() ? fmt::format("unknown key \"{}\"; legal: {}", key, fmt::join(legal, ", "))
                                  : fmt::format("unknown key \"{}\"; did you mean \"{}\"?", key, near));
  }
}

Json pose_json(const Vec3& v) { return {v.x(), v.y(), v.z()}; }

Json pose_json(const JointVec& q) {
  Json out = Json::array();
  for (const double value : q) out.push_back(value);
  return out;
}

Json pose_json(const Pose& X) {
  Json rows = Json::array();
  for (int i = 0; i < 3; ++i) rows.push_back(pose_json(Vec3(X.R.row(i))));
  return {{"p", pose_json(X.p)}, {"R", rows}};
}

Pose platform_at(const Json& request) {
  const Json& given = request.at("platform");
  check_keys(given, {"p", "R"});
  const auto rows = given.find("R");
  if (rows == given.end() || !rows->is_array() || rows->size() != 3)
    throw BadRequest("\"platform\" needs \"R\": three rows of three numbers");
  Pose X_RP = translation(vec3_at(given, "p"));
  for (int i = 0; i < 3; ++i) {
    const std::vector<double> row = numbers_at(Json{{"R", rows->at(i)}}, "R", 3);
    X_RP.R.row(i) = Vec3(row[0], row[1], row[2]);
  }
  return X_RP;
}

/// Answers the requests for one machine.
class KinServer {
 public:
  KinServer(const Machine& machine, const std::string& direction)
      : direction_(direction),
        kinematics_(make_kinematics(machine)),
        platform_(dynamic_cast<const PlatformKinematics*>(kinematics_.get())),
        corrections_(read_corrections(machine)),
        map_(*kinematics_, corrections_.pose.get(), corrections_.joint.get()) {}

  Json answer(const Json& request) const {
    if (direction_ == "forward") return forward(request);
    if (direction_ == "setpoint") return setpoint(request);
    return inverse(request);
  }

 private:
  Json failed(KinStatus status) const {
    static constexpr const char* kMeaning[] = {
        "", "the machine cannot take this pose", "the machine is singular here, or nearly so",
        "a limit of the mechanism is exceeded (an angle of a joint, or the distance of two legs)"};
    static_assert(std::size(kMeaning) == static_cast<std::size_t>(KinStatus::kLimit) + 1);
    return {{"error", to_string(status)}, {"message", kMeaning[static_cast<int>(status)]}};
  }

  static Vec3 tool_of(const Json& request) {
    const auto found = request.find("tool_length_mm");
    if (found == request.end()) return Vec3::Zero();
    if (!found->is_number()) throw BadRequest("\"tool_length_mm\" must be a number");
    return {0, 0, found->get<double>()};
  }

  Json forward(const Json& request) const {
    check_keys(request, {"q", "tool_length_mm"});
    MapContext context;
    context.tool_offset = tool_of(request);
    const JointVec q = joints_at(request, "q", kinematics_->joint_count());
    ToolPose tool;
    const KinStatus status = tool_pose(*kinematics_, q, context, tool);
    if (status != KinStatus::kOk) return failed(status);
    Json out{{"p", pose_json(tool.p_B)}, {"u", pose_json(tool.u_B)}};
    if (Pose X_BS; platform_ && kinematics_->forward(q, X_BS) == KinStatus::kOk)
      add_platform(platform_->platform_from_spindle(X_BS), out);
    return out;
  }

  /// The path point that asks for p and u: words of the branch nearest to the seed.
  KinStatus words_at(const Json& request, Words& y) const {
    Words seed = Words::Zero();
    if (request.contains("seed"))
      kinematics_->words_from_joints(joints_at(request, "seed", kinematics_->joint_count()), seed);
    Vec3 abc = Vec3::Zero();
    const KinStatus status = kinematics_->words_for_axis(vec3_at(request, "u"), seed.tail<3>(), abc);
    y << vec3_at(request, "p"), abc;
    return status;
  }

  Json inverse(const Json& request) const {
    if (request.is_object() && request.contains("platform")) return inverse_of_platform(request);
    check_keys(request, {"p", "u", "tool_length_mm", "seed"});
    Words y;
    const KinStatus status = words_at(request, y);
    if (status != KinStatus::kOk) return failed(status);
    return joints(spindle_of(y, tool_of(request)), y);
  }

  Json inverse_of_platform(const Json& request) const {
    check_keys(request, {"platform"});
    if (!platform_) throw BadRequest("this machine has no moving platform; give \"p\" and \"u\"");
    return joints(platform_->spindle_from_platform(platform_at(request)), Words::Zero());
  }

  Pose spindle_of(const Words& y, const Vec3& tool_offset) const {
    return spindle_from_tip(y.head<3>(), kinematics_->orientation(y.tail<3>()), tool_offset);
  }

  /// Nominal joints; the words' own joints are the seed, so that their rotary joints are kept.
  Json joints(const Pose& X_BS, const Words& y) const {
    JointVec seed, q;
    kinematics_->joints_from_words(y, seed);
    return report(kinematics_->inverse(X_BS, seed, q), q);
  }

  Json report(KinStatus status, const JointVec& q) const {
    if (status != KinStatus::kOk) return failed(status);
    Json out{{"q", pose_json(q)}};
    if (Pose X_RP; platform_ && platform_->platform(q, X_RP) == KinStatus::kOk) add_platform(X_RP, out);
    return out;
  }

  /// Where the platform stands and how near it is to what it cannot do.
  void add_platform(const Pose& X_RP, Json& out) const {
    out["platform"] = pose_json(X_RP);
    out["conditioning"] = platform_->conditioning(X_RP);
    if (const auto* hexapod = dynamic_cast<const Hexapod*>(platform_)) {
      out["joint_angle_deg"] = deg_from_rad(hexapod->joint_angle(X_RP));
      out["leg_distance_mm"] = hexapod->leg_distance(X_RP);
    }
  }

  Json setpoint(const Json& request) const {
    check_keys(request, {"p", "u", "tool_length_mm", "seed"});
    MapContext context;
    context.rtcp = true;
    context.tool_offset = tool_of(request);
    context.corrections_off = corrections_.planned_off;
    Words y;
    KinStatus status = words_at(request, y);
    JointVec q;
    if (status == KinStatus::kOk) status = map_.map(y, context, q);
    return report(status, q);
  }

  std::string direction_;
  std::unique_ptr<Kinematics> kinematics_;
  const PlatformKinematics* platform_;
  Corrections corrections_;
  MachineJointMap map_;
};

Json answer_line(const KinServer& server, const std::string& line, std::size_t number, Exit& exit) {
  try {
    return server.answer(Json::parse(line));
  } catch (const Json::parse_error& bad) {
    exit = Exit::kUsage;
    return {{"error", "bad_request"},
            {"line", number},
            {"message", fmt::format("not JSON at byte {}", bad.byte)}};
  } catch (const std::exception& bad) {  // a BadRequest, or a number JSON cannot hold
    exit = Exit::kUsage;
    return {{"error", "bad_request"}, {"line", number}, {"message", bad.what()}};
  }
}

Exit serve_words(const Machine& machine, bool forward) {
  const std::unique_ptr<Kinematics> kinematics = make_kinematics(machine);
  const KinWords words(machine, *kinematics);
  Exit exit = Exit::kDone;
  std::string line;
  for (std::size_t number = 1; std::getline(std::cin, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    try {
      fmt::print("{}\n", forward ? words.forward(line) : words.inverse(line));
    } catch (const std::invalid_argument& bad) {
      exit = Exit::kUsage;
      fmt::print(stderr, "line {}: {}\n", number, bad.what());
    }
    std::fflush(stdout);
  }
  return exit;
}

Exit show_directions(const Machine& machine) {
  const std::unique_ptr<Kinematics> kinematics = make_kinematics(machine);
  fmt::print("{}", KinWords(machine, *kinematics).directions());
  return Exit::kDone;
}

Exit serve(const KinOptions& options) {
  if (options.direction == "words") return show_directions(read_machine(load_config(options.machine)));
  if (options.words && options.direction == "setpoint")
    throw CLI::ValidationError("--words", "goes with forward and inverse");
  if (options.words)
    return serve_words(read_machine(load_config(options.machine)), options.direction == "forward");
  const KinServer server(read_machine(load_config(options.machine)), options.direction);
  Exit exit = Exit::kDone;
  std::string line;
  for (std::size_t number = 1; std::getline(std::cin, line); ++number) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    const Json answer = answer_line(server, line, number, exit);
    if (answer.contains("line"))
      fmt::print(stderr, "line {}: {}\n", number, answer["message"].get<std::string>());
    fmt::print("{}\n", answer.dump(-1, ' ', false, Json::error_handler_t::replace));
    std::fflush(stdout);
  }
  return exit;
}

}  // namespace

void add_kin(CLI::App& app, Exit& exit) {
  auto options = std::make_shared<KinOptions>();
  CLI::App* command = app.add_subcommand("kin", "Turn poses of the tool into joints and back, as JSON lines");
  command->add_option("direction", options->direction, "forward, inverse, setpoint or words")
      ->required()
      ->check(CLI::IsMember({"forward", "inverse", "setpoint", "words"}));
  command->add_option("--machine,-m", options->machine, kMachineOption)->required();
  command->add_flag("--words", options->words, "speak in program words, joint names and degrees");
  command->footer(kKinFooter);
  command->callback([options, &exit] { exit = serve(*options); });
}

}  // namespace trn
