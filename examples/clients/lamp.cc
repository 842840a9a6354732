// A stack light: lamp MACHINE [URL]. The types of the messages: trunnion-dev, or in this folder
//   lcm-gen --cpp --cpp-hpath . ../../hal/lcm/*.lcm
// g++ -std=c++17 -I . lamp.cc -o lamp -llcm
#include <iostream>
#include <lcm/lcm-cpp.hpp>
#include <trunnion/status_t.hpp>

void show(const lcm::ReceiveBuffer*, const std::string&, const trunnion::status_t* status, void*) {
  std::cout << (status->fault != "ok" ? "red" : status->state == "running" ? "green" : "yellow") << std::endl;
}

int main(int count, char** words) {
  if (count < 2) {
    std::cerr << "usage: lamp MACHINE [URL], with the name in the machine's config, as: lamp mill"
              << std::endl;
    return 5;
  }
  lcm::LCM link(count > 2 ? words[2] : "udpm://239.255.76.67:7667?ttl=0");
  if (!link.good()) return 4;  // LCM has said why
  link.subscribeFunction<trunnion::status_t, void*>(std::string(words[1]) + ".status", show, nullptr);
  while (link.handle() == 0) {
  }
}
