// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include <Eigen/Core>

#include "formats/format.h"
#include "truetriad/base/result.h"

namespace truetriad {

// Of names of parameters: "INS_ACCOFFS_X".
inline constexpr std::string_view kUpperCaseAxes = "XYZ";

// The named numbers of an autopilot's parameter file.
class ParameterList {
 public:
  // One parameter a line: the name in field `name_field`, the value in the next; fields are
  // separated by blanks, tabs or commas; `#` starts a comment. Errors name the line.
  static Result<ParameterList> Parse(const ExportedFile& file, std::size_t name_field);

  bool Has(const std::string& name) const { return values_.count(name) > 0; }
  // Firmware's own default when the file does not hold it. float32, as firmware stores it.
  float Get(const std::string& name, float otherwise) const;
  // A sensor's number, exactly; unset where it is no whole number, or is 0, which is no sensor's.
  std::optional<std::int64_t> Id(const std::string& name) const;
  // prefix + "X" + suffix and so on.
  Eigen::Vector3f GetVector(const std::string& prefix,
                            const std::string& suffix,
                            float otherwise) const;
  // Some of prefix + {X, Y, Z} + suffix is there.
  bool HasVector(const std::string& prefix, const std::string& suffix) const;

 private:
  std::map<std::string, float> values_;
  std::map<std::string, std::int64_t> ids_;
};

// The symmetric matrix of a diagonal and the entries xy, xz, yz.
Eigen::Matrix3f SymmetricMatrix(const Eigen::Vector3f& diagonal, const Eigen::Vector3f& off);

// A triad that an autopilot carries, as our model; temperature terms come on top.
TriadCalibration CarriedTriad(std::string_view unit,
                              const Eigen::Matrix3f& correction,
                              const Eigen::Vector3f& bias);

}  // namespace truetriad
