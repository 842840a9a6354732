#include "app/client/access_config.h"

namespace trn {

AccessConfig read_access(const ConfigTable& root) {
  AccessConfig config;
  const auto section = root.table_if("access");
  if (!section) return config;
  config.socket = section->text("socket", "");
  if (!config.socket.empty() && config.socket.front() != '/')
    throw section->error("socket", "'socket' is a whole path, from '/' on");
  config.look = section->text("look", config.look);
  config.operate = section->text("operate", "");
  config.set_up = section->text("set_up", "");
  return config;
}

}  // namespace trn
