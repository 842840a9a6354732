#include "app/cli/config_schema.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "app/cli/config_meanings.h"
#include "app/cli/config_page.h"

namespace trn {

namespace {

using Json = nlohmann::ordered_json;

std::string description(const Json& key) {
  std::string out = key["meaning"];
  if (key.contains("unit")) out += fmt::format(" Unit: {}.", key["unit"].get<std::string>());
  if (key.contains("legal_in_words"))
    out += fmt::format(" Legal: {}.", key["legal_in_words"].get<std::string>());
  if (key.contains("default_in_words"))
    out += fmt::format(" Default: {}.", key["default_in_words"].get<std::string>());
  return out;
}

Json key_schema(const Json& key) {
  static const std::map<std::string, Json> kForms = {
      {"number", {{"type", "number"}}},
      {"integer", {{"type", "integer"}}},
      {"boolean", {{"type", "boolean"}}},
      {"choice", {{"type", "string"}}},
      {"numbers", {{"type", "array"}, {"items", {{"type", "number"}}}}},
      {"three_numbers",
       {{"type", "array"}, {"items", {{"type", "number"}}}, {"minItems", 3}, {"maxItems", 3}}},
      {"texts", {{"type", "array"}, {"items", {{"type", "string"}}}}},
      {"text", {{"type", "string"}}}};
  Json out = {{"description", description(key)}};
  out.update(kForms.at(key["form"]));
  static const std::pair<const char*, const char*> kNames[] = {{"min", "minimum"},
                                                               {"above", "exclusiveMinimum"},
                                                               {"max", "maximum"},
                                                               {"choices", "enum"},
                                                               {"default", "default"}};
  for (const auto& [name, in_schema] : kNames)
    if (key.contains(name)) out[in_schema] = key[name];
  return out;
}

bool has_type(const Json& table) {
  return std::any_of(table["keys"].begin(), table["keys"].end(),
                     [](const Json& key) { return key["key"] == "type"; });
}

std::string parent_of(const std::string& path) {
  const std::size_t dot = path.rfind('.');
  return dot == std::string::npos ? "" : path.substr(0, dot);
}

/// The tables of a config by their paths, and by the type that makes them legal.
class Tables {
 public:
  explicit Tables(const Json& tables) {
    std::set<std::string> others;  // files that a config names
    for (const SectionMeaning& section : kOtherFileMeanings.sections)
      for (const ConfigPlace& place : section.places) others.insert(std::string(place.table));
    for (const Json& table : tables) {
      std::string path = table["table"];
      if (others.contains(path)) continue;
      by_path_[path].push_back(table);
      for (; !path.empty(); path = parent_of(path)) paths_.insert(path);
    }
  }

  /// The table at `path`, or every entry of the list there, where the type around it is `kind`. Null: not
  /// legal there.
  Json schema(const std::string& path, const std::string& kind) const {
    const auto found = by_path_.find(path);
    if (found == by_path_.end()) return object(path, kind, Json());
    std::vector<Json> forms;
    bool list = false;
    for (const Json& table : found->second) {
      const std::string own = table["type"];
      if (!has_type(table) && own != kind) continue;
      forms.push_back(object(path, own, table));
      list = table["array"];
    }
    if (forms.empty()) return Json();
    Json one = forms[0];
    if (forms.size() > 1) one = Json::object({{"anyOf", forms}});
    return list ? Json{{"type", "array"}, {"items", one}} : one;
  }

 private:
  bool required(const std::string& path, const std::string& kind) const {
    const auto found = by_path_.find(path);
    return found != by_path_.end() &&
           std::any_of(found->second.begin(), found->second.end(), [&](const Json& table) {
             return table["required"] && (has_type(table) || table["type"] == kind);
           });
  }

  // An endless joint has no range. Whether another one lacks its own is said where the config is read.
  static bool may_lack(const std::string& path, const std::string& key) {
    return path == "joint" && (key.starts_with("min_") || key.starts_with("max_"));
  }

  Json object(const std::string& path, const std::string& kind, const Json& table) const {
    Json properties = Json::object(), needed = Json::array();
    if (table.is_object())
      for (const Json& key : table["keys"]) {
        Json& property = properties[key["key"].get<std::string>()] = key_schema(key);
        if (key["key"] == "type" && !kind.empty()) property["enum"] = Json::array({kind});
        const bool other = key["key"] == "type" && key.contains("default") && key["default"] != kind;
        if ((key["required"] && !may_lack(path, key["key"])) || other) needed.push_back(key["key"]);
      }
    for (const std::string& child : paths_) {
      if (parent_of(child) != path) continue;
      const Json inner = schema(child, kind);
      const std::string name = child.substr(path.empty() ? 0 : path.size() + 1);
      if (inner.is_null()) continue;
      properties[name] = inner;
      if (required(child, kind)) needed.push_back(name);
    }
    if (properties.empty()) return Json();
    Json out = {{"type", "object"}, {"properties", properties}, {"additionalProperties", false}};
    if (!needed.empty()) out["required"] = needed;
    return out;
  }

  std::map<std::string, std::vector<Json>> by_path_;
  std::set<std::string> paths_;
};

}  // namespace

Json config_schema(const ConfigKeys& keys) {
  Json out = {{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", "A machine of Trunnion"}};
  out.update(Tables(config_json(keys)["tables"]).schema("", ""));
  return out;
}

}  // namespace trn
