// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <span>
#include <vector>

#include "model/limit_names.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/quality.h"

namespace truetriad {
namespace {

using enum LimitShape;

constexpr std::string_view kTrueUnit = "{true}";

// docs/experiments.md, "limits".
constexpr std::array<LimitQuantity, 11> kSensorLimits = {{
    {"bias", kAxes, kTrueUnit},
    {"scale_error", kAxes, ""},
    {"misalignment_rad", kEntries, "rad"},
    {"non_orthogonality_rad", kPairs, "rad"},
    {"bias_per_degc", kAxes, "{true}/degC"},
    {"scale_per_degc", kAxes, "1/degC"},
    {"bias_sigma", kAxes, kTrueUnit},
    {"scale_sigma", kAxes, ""},
    {"misalignment_sigma_rad", kEntries, "rad"},
    {"residual_rms", kScalar, kTrueUnit},
    {"held_out_rms", kScalar, kTrueUnit},
}};

constexpr std::array<LimitQuantity, 3> kReferenceLimits = {{
    {"reference.gravity_mps2", kScalar, "m/s^2"},
    {"reference.field_ut", kScalar, "uT"},
    {"reference.dip_deg", kScalar, "deg"},
}};

std::vector<std::string> ComponentsOf(LimitShape shape) {
  switch (shape) {
    case kScalar:
      return {};
    case kAxes:
      return {"x", "y", "z"};
    case kEntries:
      return {"xy", "xz", "yx", "yz", "zx", "zy"};
    case kPairs:
      return {"xy", "xz", "yz"};
  }
  return {};
}

Error Unknown(const std::string& name, const std::string& part, const std::string& known) {
  return Error(ErrorCode::kUnknownName,
               "limit `" + name + "`: " + part + " is not known; known are " + known)
      .About("limits." + name);
}

std::string NamesOf(std::span<const LimitQuantity> quantities) {
  std::string names;
  for (const LimitQuantity& quantity : quantities) {
    names += (names.empty() ? "" : ", ") + std::string(quantity.name);
  }
  return names;
}

const LimitQuantity* FindQuantity(std::span<const LimitQuantity> among, std::string_view name) {
  const auto found = std::find_if(
      among.begin(), among.end(), [name](const LimitQuantity& each) { return each.name == name; });
  return found == among.end() ? nullptr : &*found;
}

}  // namespace

bool LimitName::IsNeverNegative() const {
  return quantity.name.ends_with("_rms") || quantity.name.find("_sigma") != std::string_view::npos;
}

bool LimitName::IsSlope() const { return quantity.name.ends_with("_per_degc"); }

bool LimitName::GoesWithField() const {
  // An error of the common gain also changes each bias in true units, by the same share.
  return triad == Triad::kMagnetometer &&
         (quantity.name == "scale_error" || quantity.name == "bias" ||
          quantity.name == "bias_per_degc");
}

std::string LimitName::Unit() const {
  std::string unit(quantity.unit);
  if (!unit.starts_with(kTrueUnit)) return unit;
  const bool is_angle = triad == Triad::kGyroscope && quantity.shape == kScalar;
  const std::string true_unit(is_angle ? "rad" : TruthUnitName(*triad));
  return true_unit + unit.substr(kTrueUnit.size());
}

std::vector<std::string> LimitNames() {
  std::vector<std::string> names = {"reference"};
  for (const LimitQuantity& quantity : kReferenceLimits) names.emplace_back(quantity.name);
  for (const Triad triad : kTriads) {
    names.emplace_back(TriadName(triad));
    for (const LimitQuantity& quantity : kSensorLimits) {
      const std::string name = std::string(TriadName(triad)) + '.' + std::string(quantity.name);
      names.push_back(name);
      for (const std::string& part : ComponentsOf(quantity.shape))
        names.push_back(name + '.' + part);
    }
  }
  return names;
}

Result<LimitName> ParseLimitName(const std::string& name) {
  if (const LimitQuantity* found = FindQuantity(kReferenceLimits, name)) {
    return LimitName{std::nullopt, *found, ""};
  }
  const std::size_t dot = name.find('.');
  const std::optional<Triad> triad = TriadFromName(name.substr(0, dot));
  if (!triad || dot == std::string::npos) {
    return Unknown(
        name,
        "`" + name.substr(0, dot) + "`",
        "quantities of the sensors, like accelerometer.bias, and " + NamesOf(kReferenceLimits));
  }
  const std::size_t second = name.find('.', dot + 1);
  const std::string what = name.substr(dot + 1, second - dot - 1);
  const LimitQuantity* found = FindQuantity(kSensorLimits, what);
  if (found == nullptr) return Unknown(name, "`" + what + "`", NamesOf(kSensorLimits));
  LimitName parsed{triad, *found, ""};
  if (second == std::string::npos) return parsed;
  parsed.component = name.substr(second + 1);
  const std::vector<std::string> components = ComponentsOf(found->shape);
  if (std::find(components.begin(), components.end(), parsed.component) == components.end()) {
    std::string known = "none, since it is one number";
    for (const std::string& each : components) {
      known = &each == &components.front() ? each : known + ", " + each;
    }
    return Unknown(name, "the component `" + parsed.component + "` of " + what, known);
  }
  return parsed;
}

}  // namespace truetriad
