// SPDX-License-Identifier: Apache-2.0
#include "tools/truetriad/format_flags.h"

#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>

#include "truetriad/base/units.h"

DEFINE_string(instance,
              "",
              "which of several sensors of one kind, numbered as in the other system");
DEFINE_string(units,
              "",
              "units of the readings, as in g,deg/s,uT, if the format does not state them");
DEFINE_string(outside_limits,
              "refuse",
              "what becomes of exports of a unit that is outside its limits or refused: refuse, or "
              "allow, and the files say so");

namespace truetriad {
namespace {

template <typename Number>
Result<Number> Parse(const std::string& flag, const std::string& text) {
  Number value{};
  const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failure != std::errc() || end != text.data() + text.size()) {
    return Error(ErrorCode::kInvalidArgument,
                 "--" + flag + ": `" + text + "` is not a valid number");
  }
  return value;
}

}  // namespace

Result<std::int64_t> ParseInteger(const std::string& flag, const std::string& text) {
  return Parse<std::int64_t>(flag, text);
}

Result<double> ParseReal(const std::string& flag, const std::string& text) {
  const Result<double> value = Parse<double>(flag, text);
  if (value && !std::isfinite(*value))
    return Error(ErrorCode::kInvalidArgument, "--" + flag + ": must be finite");
  return value;
}

Result<std::optional<int>> ParseInstance() {
  if (FLAGS_instance.empty()) return std::optional<int>();
  TRUETRIAD_ASSIGN_OR_RETURN(const std::int64_t instance, ParseInteger("instance", FLAGS_instance));
  if (instance < 0 || instance > std::numeric_limits<int>::max()) {
    return Error(ErrorCode::kInvalidArgument,
                 "--instance=" + FLAGS_instance + ": no such instance; expected 0 or more");
  }
  return std::optional<int>(static_cast<int>(instance));
}

Result<bool> AllowsOutsideLimits() {
  if (FLAGS_outside_limits == "allow") return true;
  if (FLAGS_outside_limits == "refuse") return false;
  return Error(
      ErrorCode::kInvalidArgument,
      "--outside-limits=" + FLAGS_outside_limits + " is invalid; expected refuse or allow");
}

Result<PerTriad<std::optional<std::string>>> ParseUnits() {
  PerTriad<std::optional<std::string>> units;
  std::istringstream items(FLAGS_units);
  for (std::string item; std::getline(items, item, ',');) {
    bool known = false;
    for (const Triad triad : kTriads) {
      if (!ParseTriadUnit(triad, item)) continue;
      if (units[triad] && item != "counts" && *units[triad] != "counts") {
        return Error(ErrorCode::kConflictingArguments,
                     "--units: `" + *units[triad] + "` and `" + item + "` are both units of the " +
                         std::string(TriadName(triad)) + "; give one");
      }
      if (!units[triad] || item != "counts") units[triad] = item;
      known = true;
    }
    if (!known) {
      return Error(ErrorCode::kInvalidArgument,
                   "--units: `" + item +
                       "` is not a unit; expected one of m/s^2, g, mg, rad/s, deg/s, uT, nT, mT, "
                       "T, G, mG, counts");
    }
  }
  return units;
}

}  // namespace truetriad
