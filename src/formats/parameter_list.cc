// SPDX-License-Identifier: Apache-2.0
#include "formats/parameter_list.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <sstream>
#include <vector>

#include <Eigen/LU>

namespace truetriad {
namespace {

std::vector<std::string> Fields(std::string line) {
  line.resize(std::min(line.find('#'), line.size()));
  for (char& c : line) {
    if (c == ',' || c == '\t' || c == '\r') c = ' ';
  }
  std::istringstream words(line);
  std::vector<std::string> fields;
  for (std::string word; words >> word;) fields.push_back(word);
  return fields;
}

}  // namespace

Result<ParameterList> ParameterList::Parse(const ExportedFile& file, std::size_t name_field) {
  ParameterList list;
  std::istringstream lines(file.text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    const std::vector<std::string> fields = Fields(line);
    if (fields.empty()) continue;
    const FilePlace place{file.suffix, number};
    if (fields.size() < name_field + 2) {
      return Error(ErrorCode::kWrongFormat,
                   place,
                   "`" + line + "` is not a parameter; expected a name and a value");
    }
    const std::string& text = fields[name_field + 1];
    float value = 0.0F;
    const auto [end, failure] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (failure != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
      return Error(ErrorCode::kUnreadableNumber,
                   place,
                   fields[name_field] + ": `" + text +
                       "` is not a number; expected a name and a value on each line");
    }
    std::int64_t id = 0;
    const auto [id_end, no_id] = std::from_chars(text.data(), text.data() + text.size(), id);
    // Some programs write all numbers with decimals.
    const bool is_whole =
        std::all_of(id_end + (*id_end == '.'), end, [](char c) { return c == '0'; });
    if (no_id == std::errc() && is_whole && id != 0) list.ids_[fields[name_field]] = id;
    if (!list.values_.emplace(fields[name_field], value).second) {
      return Error(
          ErrorCode::kDuplicateKey, place, fields[name_field] + " occurs twice; remove one");
    }
  }
  return list;
}

float ParameterList::Get(const std::string& name, float otherwise) const {
  const auto found = values_.find(name);
  return found == values_.end() ? otherwise : found->second;
}

std::optional<std::int64_t> ParameterList::Id(const std::string& name) const {
  const auto found = ids_.find(name);
  return found == ids_.end() ? std::nullopt : std::optional(found->second);
}

Eigen::Vector3f ParameterList::GetVector(const std::string& prefix,
                                         const std::string& suffix,
                                         float otherwise) const {
  Eigen::Vector3f vector;
  for (int i = 0; i < 3; ++i) {
    vector[i] = Get(prefix + kUpperCaseAxes[static_cast<std::size_t>(i)] + suffix, otherwise);
  }
  return vector;
}

bool ParameterList::HasVector(const std::string& prefix, const std::string& suffix) const {
  for (const char axis : kUpperCaseAxes) {
    if (Has(prefix + axis + suffix)) return true;
  }
  return false;
}

Eigen::Matrix3f SymmetricMatrix(const Eigen::Vector3f& diagonal, const Eigen::Vector3f& off) {
  Eigen::Matrix3f matrix;
  matrix << diagonal[0], off[0], off[1], off[0], diagonal[1], off[2], off[1], off[2], diagonal[2];
  return matrix;
}

TriadCalibration CarriedTriad(std::string_view unit,
                              const Eigen::Matrix3f& correction,
                              const Eigen::Vector3f& bias) {
  TriadCalibration sensor;
  sensor.input_unit = sensor.output_unit = unit;
  sensor.model.sensitivity = correction.cast<double>().inverse();
  sensor.model.bias = bias.cast<double>();
  sensor.noise.source = NoiseSource::kConfig;
  return sensor;
}

}  // namespace truetriad
