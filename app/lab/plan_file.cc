#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "app/lab/plan_preview.h"
#include "core/axes.h"
#include "core/frames.h"
#include "core/machine.h"
#include "core/safe_file.h"

namespace trn {

namespace {

using nlohmann::json;

constexpr char kMark[] = "TRNPLAN2";  // 8 characters
constexpr float kWhole = 200;         // a limit that is used whole

/// One value of every point after the other, as the page's typed arrays take them; each array begins at a
/// multiple of four bytes.
class ArrayFile {
 public:
  explicit ArrayFile(const std::string& path) : path_(path), out_(path, std::ios::binary) {}

  void text(const std::string& bytes) {
    out_ << bytes;
    pad(bytes.size());
  }
  template <typename Value, typename Of>
  void array(const std::vector<PlanPoint>& points, Of of) {
    std::vector<Value> values;
    values.reserve(points.size());
    for (const PlanPoint& point : points) values.push_back(static_cast<Value>(of(point)));
    const std::size_t size = values.size() * sizeof(Value);
    out_.write(reinterpret_cast<const char*>(values.data()), static_cast<std::streamsize>(size));
    pad(size);
  }
  void close() {
    out_.close();
    if (!out_) throw OutputError(fmt::format("{}: cannot write this file: {}", path_, std::strerror(errno)));
  }

 private:
  void pad(std::size_t size) {
    for (; size % 4 != 0; ++size) out_.put(' ');
  }
  std::string path_;
  std::ofstream out_;
};

json vector_json(const Vec3& v) { return {v[0], v[1], v[2]}; }

json head_of(const PlanPreview& preview, const Machine& machine, const std::string& program) {
  json joints = json::array();
  for (std::size_t i = 0; i < machine.joints.size(); ++i) {
    const Joint& joint = machine.joints[i];
    const auto k = static_cast<Eigen::Index>(i);
    joints.push_back({{"name", joint.name},
                      {"unit", joint.kind == JointKind::kRotary ? "rad" : "mm"},
                      {"min", joint.limit.min},
                      {"max", joint.limit.max},
                      {"from", preview.q_min[k]},
                      {"to", preview.q_max[k]},
                      {"limited_s", preview.limited_s[i]}});
  }
  json head{
      {"program", program},       {"count", preview.points.size()}, {"time_s", preview.time_s},
      {"cut_mm", preview.cut_mm}, {"rapid_mm", preview.rapid_mm},   {"free_s", preview.free_s},
      {"blocks", preview.blocks}, {"message", preview.message},     {"message_line", preview.message_line},
      {"joints", joints}};
  if (!preview.points.empty()) head["box"] = {vector_json(preview.box_B[0]), vector_json(preview.box_B[1])};
  return head;
}

std::string size_bytes(std::size_t size) {
  std::string out(4, '\0');
  for (std::size_t i = 0; i < 4; ++i) out[i] = static_cast<char>(size >> (8 * i) & 0xFF);
  return out;
}

unsigned share(float of_limit) {
  return static_cast<unsigned>(std::clamp(std::round(of_limit * kWhole), 0.0F, 255.0F));
}

}  // namespace

void write_plan(const std::string& path, const PlanPreview& preview, const Machine& machine,
                const std::string& program) {
  const std::string head =
      head_of(preview, machine, program).dump(-1, ' ', false, json::error_handler_t::replace);
  const std::vector<PlanPoint>& points = preview.points;
  ArrayFile file(path);
  file.text(kMark + size_bytes(head.size()) + head);
  for (int i = 0; i < 3; ++i) file.array<float>(points, [i](const PlanPoint& p) { return p.p_B[i]; });
  file.array<float>(points, [](const PlanPoint& p) { return p.time_s; });
  file.array<float>(points, [](const PlanPoint& p) { return p.speed_mm_s; });
  file.array<float>(points, [](const PlanPoint& p) { return p.feed_mm_s; });
  file.array<float>(points, [](const PlanPoint& p) { return p.significance; });
  file.array<float>(points, [](const PlanPoint& p) { return p.deviation_mm; });
  file.array<std::uint32_t>(points, [](const PlanPoint& p) { return p.line; });
  file.array<std::uint8_t>(points, [](const PlanPoint& p) { return share(p.velocity); });
  file.array<std::uint8_t>(points, [](const PlanPoint& p) { return share(p.acceleration); });
  file.array<std::uint8_t>(points, [](const PlanPoint& p) { return share(p.jerk); });
  file.array<std::uint8_t>(points, [](const PlanPoint& p) { return p.joint < 0 ? 255 : p.joint; });
  file.array<std::uint8_t>(points, [](const PlanPoint& p) { return (p.rapid ? 1 : 0) | (p.jump ? 2 : 0); });
  file.close();
}

}  // namespace trn
