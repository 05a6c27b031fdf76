// SPDX-License-Identifier: Apache-2.0
#include "base/companion.h"
#include "formats/matlab_module.h"
#include "formats/matlab_values.h"

namespace truetriad {
namespace {

// Loaded once, kept until the program ends. Nullptr: it is not there, or does not load.
const MatlabModule* Module() {
  static const MatlabModule* const module = []() -> const MatlabModule* {
    const Result<void*> function = CompanionFunction(kMatlabModuleFile, kMatlabModuleFunction);
    return function ? reinterpret_cast<const MatlabModule* (*)()>(*function)() : nullptr;
  }();
  return module;
}

constexpr char kHowToHaveIt[] = "; build it with `tools/build.sh programs`";

}  // namespace

Result<std::string> MatFileBytes(const MatlabVariables& variables,
                                 const std::vector<std::string>& comment) {
  if (Module() != nullptr) return Module()->write(variables, comment);
  return Error(
      ErrorCode::kMissingProgram,
      std::string("writing a .mat needs ") + kMatlabModuleFile + kHowToHaveIt +
          ". Or write a script, which does not need it: give --output a name ending in .m");
}

Result<MatlabVariables> ParseMatFile(const std::string& bytes, const std::string& name) {
  if (Module() != nullptr) return Module()->parse(bytes, name);
  return Error(ErrorCode::kMissingProgram,
               {name},
               std::string("reading a .mat needs ") + kMatlabModuleFile + kHowToHaveIt);
}

}  // namespace truetriad
