#include "app/client/gateway_config.h"

#include <gtest/gtest.h>

#include <string>

#include "app/client/signing_key.h"
#include "core/config.h"

namespace trn {
namespace {

const std::string kKey = "11qYAYKxCrfVS/7TyWQHOg7hcvPapiMlrwIaaPcHURo=";

std::string entry(const std::string& name, const std::string& key, const std::string& role) {
  return "[[gateway.key]]\nname = \"" + name + "\"\npublic = \"" + key + "\"\nrole = \"" + role + "\"\n";
}

GatewayConfig read(const std::string& text) {
  const ConfigTable root = parse_config(text, "/etc/trunnion/mill.toml");
  GatewayConfig config = read_gateway(root);
  root.finish();
  return config;
}

std::string refusal(const std::string& text) {
  try {
    read(text);
  } catch (const ConfigError& error) {
    return error.what();
  }
  return "";
}

TEST(GatewayConfig, ThereIsNoneByDefault) {
  const GatewayConfig config = read("");
  EXPECT_EQ(config.url, "");
  EXPECT_TRUE(config.keys.empty());
}

TEST(GatewayConfig, IsReadAsItStands) {
  const GatewayConfig config =
      read("[gateway]\nurl = \"udpm://239.1.2.3:7000?ttl=1\"\ncounters = \"/var/lib/c\"\nrate_hz_max = 20\n" +
           entry("anna", kKey, "set up") + entry("bert@desk-2", "keys/bert.pub", "look") +
           entry("c", "/etc/keys/c", "operate"));
  EXPECT_EQ(config.url, "udpm://239.1.2.3:7000?ttl=1");
  EXPECT_EQ(config.counters, "/var/lib/c");
  EXPECT_EQ(config.rate_hz_max, 20);
  ASSERT_EQ(config.keys.size(), 3u);
  EXPECT_EQ(config.keys[0].role, Role::kSetUp);
  EXPECT_EQ(config.keys[0].public_text, kKey);
  EXPECT_EQ(config.keys[1].role, Role::kLook);
  EXPECT_EQ(config.keys[1].public_text, "/etc/trunnion/keys/bert.pub") << "beside the config";
  EXPECT_EQ(config.keys[2].role, Role::kOperate);
  EXPECT_EQ(config.keys[2].public_text, "/etc/keys/c");
}

TEST(GatewayConfig, WhatKeyMakePrintsIsLegal) {
  const GatewayConfig config = read(config_section("anna", *public_key_of(kKey), Role::kSetUp));
  ASSERT_EQ(config.keys.size(), 1u);
  EXPECT_EQ(config.keys[0].role, Role::kSetUp);
  EXPECT_EQ(config.keys[0].public_text, kKey);
}

TEST(GatewayConfig, RefusesWhatItCannotMean) {
  const std::string good = entry("anna", kKey, "look");
  EXPECT_EQ(refusal(good), "");
  EXPECT_NE(refusal("[gateway]\nurl = \"tcp://x\"").find("legal url"), std::string::npos);
  EXPECT_NE(refusal("[gateway]\ncounters = \"here\"").find("whole path"), std::string::npos);
  EXPECT_NE(refusal("[gateway]\nrate_hz_max = 0.5").find("1 to 200"), std::string::npos);
  EXPECT_NE(refusal(entry("anna", kKey, "operator")).find("\"operate\""), std::string::npos);
  EXPECT_NE(refusal("[[gateway.key]]\nname = \"a\"\npublic = \"" + kKey + "\"\n").find("role"),
            std::string::npos);
  EXPECT_NE(refusal(entry("anna b", kKey, "look")).find("1 to 40"), std::string::npos);
  EXPECT_NE(refusal(entry("", kKey, "look")).find("1 to 40"), std::string::npos);
  EXPECT_NE(refusal(entry("anna", std::string(43, 'A'), "look")).find("'public'"), std::string::npos);
  EXPECT_NE(refusal(entry("anna", "AAAA", "look")).find("'public'"), std::string::npos);
  EXPECT_NE(refusal(good + entry("anna", "/x", "look")).find("has this name"), std::string::npos);
  EXPECT_NE(refusal(good + entry("bert", kKey, "look")).find("is the same"), std::string::npos);
}

}  // namespace
}  // namespace trn
