#pragma once

#include <cstring>
#include <iterator>
#include <nlohmann/json.hpp>
#include <string>
#include <type_traits>

#include "hal/lcm_messages.h"
#include "hal/message_fields.h"
#include "lcm_types/fields.h"

namespace trn {

namespace message_json {

template <typename Value>
nlohmann::json plain(const Value& value, bool boolean) {
  if constexpr (std::is_arithmetic_v<Value>)
    return boolean ? nlohmann::json(value != 0) : nlohmann::json(value);
  else if constexpr (std::is_same_v<Value, std::string>)
    return value;
  else {
    nlohmann::json out = nlohmann::json::array();
    for (const auto& element : value) out.push_back(plain(element, boolean));
    return out;
  }
}

}  // namespace message_json

/// A message as JSON, each field under the name that its .lcm file gives it. Fields of a list are brought
/// together: joint_name[joint_count] and joint_homed[joint_count] become "joints": [{"name": "X", "homed":
/// true}, ...]. Other arrays stay arrays.
template <typename Message>
nlohmann::json json_of(const Message& message) {
  nlohmann::json out = nlohmann::json::object();
  MessageFields<Message>::each(message, [&](const MessageField& field, const auto& value) {
    const nlohmann::json json = message_json::plain(value, field.boolean);
    const std::string name = field.name, count = field.count;
    const std::string prefix = count.substr(0, count.rfind("_count") + 1);  // "joint_"
    if (count.empty() || name.rfind(prefix, 0) != 0) {
      out[name] = json;
      return;
    }
    nlohmann::json& list = out[prefix.substr(0, prefix.size() - 1) + "s"];
    if (list.is_null()) list = nlohmann::json::array();
    for (std::size_t i = 0; i < json.size(); ++i) list[i][name.substr(prefix.size())] = json[i];
  });
  return out;
}

}  // namespace trn
