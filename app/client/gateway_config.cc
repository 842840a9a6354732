#include "app/client/gateway_config.h"

#include <algorithm>
#include <exception>
#include <filesystem>

#include "app/client/signing_key.h"
#include "hal/udp_group.h"

namespace trn {

namespace {

constexpr std::size_t kKeysMax = 64;

void check_url(const ConfigTable& section, const std::string& url) {
  if (url.empty()) return;
  try {
    UdpAddress::parse(url);
  } catch (const std::exception& error) {
    throw section.error("url", error.what());
  }
}

// A path is told from a key by the key's form: 44 characters that are base64 of 32 bytes.
std::string public_of(const ConfigTable& entry) {
  const std::string text = entry.text("public");
  if (public_key_of(text)) return text;
  const bool is_path = text.find('/') != std::string::npos || text.ends_with(".pub");
  if (!is_path)
    throw entry.error("public",
                      "'public' is neither a public key (44 characters, as 'trunnion key show' prints them) "
                      "nor the path of a file with one");
  return std::filesystem::path(entry.file()).parent_path() / text;
}

GatewayConfig::Key read_key(const ConfigTable& entry) {
  GatewayConfig::Key key;
  key.name = entry.text("name");
  if (const std::string bad = refuse_key_name(key.name); !bad.empty()) throw entry.error("name", bad);
  key.public_text = public_of(entry);
  const std::string role = entry.choice("role", {"look", "operate", "set up"});
  while (to_string(key.role) != role) key.role = static_cast<Role>(static_cast<int>(key.role) + 1);
  return key;
}

}  // namespace

GatewayConfig read_gateway(const ConfigTable& root) {
  GatewayConfig config;
  const auto section = root.table_if("gateway");
  if (!section) return config;
  config.url = section->text("url", "");
  check_url(*section, config.url);
  config.counters = section->text("counters", "");
  if (!config.counters.empty() && config.counters.front() != '/')
    throw section->error("counters", "'counters' is a whole path, from '/' on");
  config.rate_hz_max = section->number("rate_hz_max", config.rate_hz_max, Range{1, 200});
  for (const ConfigTable& entry : section->tables_if("key")) {
    const GatewayConfig::Key key = read_key(entry);
    for (const GatewayConfig::Key& other : config.keys) {
      if (other.name == key.name) throw entry.error("name", "another key has this name");
      if (other.public_text == key.public_text) throw entry.error("public", "another key is the same");
    }
    config.keys.push_back(key);
  }
  if (config.keys.size() > kKeysMax) throw section->error("key", "64 keys are possible");
  return config;
}

}  // namespace trn
