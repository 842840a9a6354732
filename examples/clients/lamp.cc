// A stack light: lamp MACHINE [URL]. g++ -std=c++17 lamp.cc -o lamp -llcm (types: trunnion-dev, or lcm-gen
// --cpp)
#include <iostream>
#include <lcm/lcm-cpp.hpp>
#include <trunnion/status_t.hpp>

void show(const lcm::ReceiveBuffer*, const std::string&, const trunnion::status_t* status, void*) {
  std::cout << (status->fault != "ok" ? "red" : status->state == "running" ? "green" : "yellow") << std::endl;
}

int main(int count, char** words) {
  lcm::LCM link(count > 2 ? words[2] : "udpm://239.255.76.67:7667?ttl=0");
  link.subscribeFunction<trunnion::status_t, void*>(std::string(words[1]) + ".status", show, nullptr);
  while (link.handle() == 0) {
  }
}
