#include "core/signal_name.h"

#include <gtest/gtest.h>

#include <string>

#include "core/config.h"
#include "core/machine.h"

// Names of inputs, outputs and states as configs write them.
namespace trn {
namespace {

using Kind = SignalName::Kind;

const std::string kMachine =
    "[machine]\nname = \"m\"\nperiod_s = 0.001\n"
    "[[joint]]\nname = \"X\"\ntype = \"linear\"\nmin_mm = -100\nmax_mm = 100\nvelocity_mm_s = 500\n"
    "acceleration_mm_s2 = 5000\njerk_mm_s3 = 100000\n"
    "[[joint]]\nname = \"A\"\ntype = \"rotary\"\nmin_deg = -90\nmax_deg = 90\nvelocity_deg_s = 120\n"
    "acceleration_deg_s2 = 800\njerk_deg_s3 = 16000\n";

struct SignalNames : testing::Test {
  SignalName read(const std::string& name) const {
    return read_signal_name(machine, parse_config("from = \"" + name + "\"\n", "t.toml"), "from");
  }
  std::string refusal(const std::string& name) const {
    try {
      read(name);
    } catch (const ConfigError& error) {
      return error.what();
    }
    return "";
  }
  Machine machine = read_machine(parse_config(kMachine, "m.toml"));
};

TEST_F(SignalNames, EachFormIsReadAndWrittenAgain) {
  const struct {
    const char* text;
    SignalName name;
  } kForms[] = {{"io.input.0", {Kind::kIoInput, -1, 0}},
                {"io.output.63", {Kind::kIoOutput, -1, 63}},
                {"drive.X.input.31", {Kind::kDriveInput, 0, 31}},
                {"drive.A.output.0", {Kind::kDriveOutput, 1, 0}},
                {"machine.enabled", {Kind::kMachine, -1, static_cast<int>(MachineSignal::kEnabled)}},
                {"machine.flood", {Kind::kMachine, -1, static_cast<int>(MachineSignal::kFlood)}}};
  for (const auto& form : kForms) {
    EXPECT_EQ(read(form.text), form.name) << form.text;
    EXPECT_EQ(to_string(form.name, machine), form.text);
  }
}

TEST_F(SignalNames, AnyOtherFormIsRefusedWithWhatIsLegal) {
  for (const char* text : {"", "io", "io.input", "io.input.3.4", "drive.input.3", "drive.X.input.3.4",
                           "machine", "machine.enabled.0", "plc.input.3"})
    EXPECT_NE(refusal(text).find("it has another form"), std::string::npos) << text;
  EXPECT_NE(refusal("io.inputs.3").find("'inputs' is neither input nor output"), std::string::npos);
  EXPECT_NE(refusal("drive.Y.input.3").find("there is no joint 'Y'"), std::string::npos);
  EXPECT_NE(refusal("machine.runing").find("legal: enabled, moving"), std::string::npos);
  for (const char* text : {"io.input.64", "io.input.-1", "io.output.x", "io.output."})
    EXPECT_NE(refusal(text).find("the number must be 0 to 63"), std::string::npos) << text;
  EXPECT_NE(refusal("drive.X.input.32").find("the number must be 0 to 31"), std::string::npos);
  EXPECT_EQ(refusal("io.input.64").substr(0, 12), "t.toml:1:8: ");
}

}  // namespace
}  // namespace trn
