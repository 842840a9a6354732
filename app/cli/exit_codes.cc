#include <fmt/format.h>

#include <cstdio>

#include "app/check/trace_reader.h"
#include "app/cli/commands.h"
#include "core/config.h"
#include "core/safe_file.h"
#include "hal/can/eds.h"
#include "interp/move.h"

namespace trn {

namespace {

Exit told(const std::exception& error, Exit exit) {
  fmt::print(stderr, "{}\n", error.what());
  return exit;
}

}  // namespace

Exit tell_exception(Exit otherwise) {
  try {
    throw;
  } catch (const CLI::ParseError&) {
    throw;
  } catch (const ConfigError& error) {
    return told(error, Exit::kBadConfig);
  } catch (const EdsError& error) {
    return told(error, Exit::kBadConfig);
  } catch (const ProgramError& error) {
    return told(error, Exit::kBadProgram);
  } catch (const FileError& error) {
    return told(error, Exit::kBadProgram);
  } catch (const OutputError& error) {
    return told(error, Exit::kUsage);
  } catch (const TraceError& error) {
    return told(error, Exit::kBadProgram);
  } catch (const std::exception& error) {
    return told(error, otherwise);
  }
}

}  // namespace trn
