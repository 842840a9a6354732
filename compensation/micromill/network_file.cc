#include <fmt/format.h>
#include <fmt/ranges.h>

#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>

#include "compensation/micromill/friction_network.h"
#include "core/config.h"
#include "core/safe_file.h"

namespace trn {

namespace {

// CRC-32 (ISO 3309, the polynomial of Ethernet, reflected).
std::uint32_t crc32(const std::string& text) {
  std::uint32_t crc = 0xffffffffu;
  for (const char c : text) {
    crc ^= static_cast<unsigned char>(c);
    for (int bit = 0; bit < 8; ++bit) crc = crc >> 1 ^ ((crc & 1u) ? 0xedb88320u : 0u);
  }
  return ~crc;
}

std::string number_list(const std::vector<double>& values) {
  std::string out;
  // 17 digits give back the same double. Fewer would change the last bits, and the checksum with them.
  for (std::size_t i = 0; i < values.size(); ++i)
    out += fmt::format("{}{:.17g},", i % 4 ? " " : "\n  ", values[i]);
  return out;
}

std::string checksum(const FrictionNetwork& network) {
  const FrictionNetwork::Shape& s = network.shape();
  return fmt::format(
      "{:08x}", crc32(fmt::format("{} {} {} {:.17g} {} {:.17g} {:.17g} {:.17g} {:.17g}", s.line.delays,
                                  s.line.spacing, s.layers, s.standing_mm, s.nodes, s.position_scale_mm,
                                  s.travel_scale_mm, s.force_scale_N, fmt::join(network.weights(), " "))));
}

std::string network_text(const char* axis, const FrictionNetwork& network, const TrainingRecord& r) {
  const FrictionNetwork::Shape& s = network.shape();
  std::string out = fmt::format("\n[{}]\ndelays = {}\nspacing_periods = {}\nstanding_mm = {:.17g}\n", axis,
                                s.line.delays, s.line.spacing, s.standing_mm);
  out += fmt::format("layers = {}\nnodes = {}\nposition_scale_mm = {:.17g}\ntravel_scale_mm = {:.17g}\n",
                     s.layers, s.nodes, s.position_scale_mm, s.travel_scale_mm);
  out += fmt::format("force_scale_N = {:.17g}\nchecksum = \"{}\"\nweights = [{}\n]\n", s.force_scale_N,
                     checksum(network), number_list(network.weights()));
  out += fmt::format(
      "\n[{}.record]\nmethod = \"{}\"\ndata = \"{}\"\nsamples = {}\niterations = {}\nstarts = {}\n", axis,
      r.method, r.data, r.samples, r.iterations, r.starts);
  out += fmt::format("rms_training_N = {:.6g}\nexplained_training = {:.6g}\nrms_validation_N = {:.6g}\n",
                     r.rms_training_N, r.explained_training, r.rms_validation_N);
  out += fmt::format("explained_validation = {:.6g}\ninnovation_rms_mm = {:.6g}\n", r.explained_validation,
                     r.innovation_rms_mm);
  return out;
}

FrictionNetwork read_network(const ConfigTable& table) {
  FrictionNetwork::Shape s;
  s.line.delays = static_cast<int>(table.integer("delays", Range{1, DelayLine::kDelaysMax}));
  s.line.spacing = static_cast<int>(table.integer("spacing_periods", Range{1, DelayLine::kSpacingMax}));
  s.standing_mm = table.number("standing_mm", kNotNegative);
  s.layers = static_cast<int>(table.integer("layers", Range{1, FrictionNetwork::kLayersMax}));
  s.nodes = static_cast<int>(table.integer("nodes", Range{1, FrictionNetwork::kNodesMax}));
  s.position_scale_mm = table.number("position_scale_mm", kPositive);
  s.travel_scale_mm = table.number("travel_scale_mm", kPositive);
  s.force_scale_N = table.number("force_scale_N", kPositive);
  const std::vector<double> weights = table.numbers("weights");
  if (static_cast<int>(weights.size()) != s.weight_count())
    throw table.error("weights", fmt::format("has {} numbers; a network of this shape has {}", weights.size(),
                                             s.weight_count()));
  // The checksum is taken over the numbers as they were read, so a file may be laid out anew, but no weight
  // may differ.
  const FrictionNetwork network(s, weights);
  if (const std::string given = table.text("checksum"); given != checksum(network))
    throw table.error("checksum",
                      fmt::format("\"{}\" does not fit the weights, whose checksum is \"{}\"; the file "
                                  "was changed by hand or damaged: train again",
                                  given, checksum(network)));
  return network;
}

TrainingRecord read_record(const ConfigTable& table) {
  TrainingRecord r;
  r.method = table.text("method");
  r.data = table.text("data");
  r.samples = static_cast<int>(table.integer("samples"));
  r.iterations = static_cast<int>(table.integer("iterations"));
  r.starts = static_cast<int>(table.integer("starts"));
  r.rms_training_N = table.number("rms_training_N");
  r.explained_training = table.number("explained_training");
  r.rms_validation_N = table.number("rms_validation_N");
  r.explained_validation = table.number("explained_validation");
  r.innovation_rms_mm = table.number("innovation_rms_mm", kPositive);
  return r;
}

}  // namespace

StageNetworks read_networks(const std::string& path) { return read_networks(load_config(path)); }

StageNetworks read_networks(const ConfigTable& root) {
  StageNetworks out;
  for (std::size_t i = 0; i < 2; ++i) {
    const ConfigTable axis = root.table(kStageAxes[i]);
    out.network[i] = read_network(axis);
    out.record[i] = read_record(axis.table("record"));
  }
  root.finish();
  return out;
}

void write_networks(const std::string& path, const StageNetworks& networks) {
  std::ofstream out(path);
  out << "# Friction and force ripple of a stage's axes, learnt by `trunnion micromill train`. N against the "
         "positive\n"
         "# direction. Inputs: position over position_scale_mm, then the travel from tap to tap over "
         "travel_scale_mm,\n"
         "# newest first. Weights: layer by layer, matrix column by column, then bias; sigmoid nodes, linear "
         "output.\n";
  for (std::size_t i = 0; i < 2; ++i)
    out << network_text(kStageAxes[i], networks.network[i], networks.record[i]);
  out.close();
  if (!out) throw OutputError(fmt::format("{}: cannot write the networks: {}", path, std::strerror(errno)));
}

}  // namespace trn
