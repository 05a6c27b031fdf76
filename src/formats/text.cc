// SPDX-License-Identifier: Apache-2.0
#include "formats/text.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <sstream>

#include "io/yaml_fields.h"

namespace truetriad {
namespace {

constexpr std::string_view kReadings = ": readings in ";
constexpr std::string_view kResult = ", result in ";

/// True units in one raw unit. Error: the readings are counts of unknown size.
Result<double> TruthPerRaw(const AllanTriad& found) {
  if (!found.unit.is_counts) return found.unit.truth_per_raw;
  if (found.si_per_count) return *found.si_per_count;
  return Error(ErrorCode::kCountsOfUnknownSize,
               "the Allan deviation of the " + std::string(TriadName(found.triad)) +
                   " is in counts of unknown size; state `si_per_count:` in the recording's "
                   "manifest and run `allan` again");
}

}  // namespace

std::vector<float> ReadConstant(const std::string& text, const std::string& declaration) {
  std::vector<float> numbers;
  const std::size_t declared = text.find(declaration);
  if (declared == std::string::npos) return numbers;
  const std::size_t end = std::min(text.find(';', declared), text.size());
  for (std::size_t at = text.find('{', declared); at < end;) {
    at = text.find_first_of("-.0123456789", at);
    if (at >= end) break;
    float value = 0.0F;
    const auto result = std::from_chars(text.data() + at, text.data() + end, value);
    numbers.push_back(value);
    at = static_cast<std::size_t>(result.ptr - text.data()) + 1;  // After the suffix f.
  }
  return numbers;
}

std::vector<WordLine> WordLines(const ExportedFile& file) {
  std::vector<WordLine> found;
  std::istringstream lines(file.text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    std::string plain = line.substr(0, line.find('#'));
    std::ranges::replace(plain, ',', ' ');
    std::istringstream words(plain);
    using Word = std::istream_iterator<std::string>;
    found.push_back({{file.suffix, ++number}, line, {Word(words), Word()}});
  }
  return found;
}

std::string UnitPhrase(const std::string& serial) { return "Calibration of " + UnitName(serial); }

std::string UnitName(const std::string& serial) {
  return serial.empty() ? "a unit without serial number" : serial;
}

std::string CommentText(std::string_view prefix, const std::vector<std::string>& lines) {
  std::string text;
  for (const std::string& line : lines) text.append(prefix).append(line).append("\n");
  return text;
}

std::string UnitComment(Triad triad, std::string_view reading_unit, std::string_view result_unit) {
  std::string text(TriadName(triad));
  return text.append(kReadings)
      .append(reading_unit)
      .append(kResult)
      .append(result_unit)
      .append(".");
}

std::string UnitFromComment(const std::string& text, Triad triad) {
  const std::string begin = std::string(TriadName(triad)).append(kReadings);
  const std::size_t at = text.find(begin);
  if (at == std::string::npos) return "";
  const std::size_t unit = at + begin.size();
  const std::size_t end = text.find(kResult, unit);
  return end == std::string::npos ? "" : text.substr(unit, end - unit);
}

Stated ReadFields(YamlReader map, std::span<const Field> fields, bool in_rows) {
  Stated stated;
  while (!fields.empty()) {
    std::size_t count = 0;
    Eigen::Index size = 0;
    for (; count < fields.size() && fields[count].name == fields[0].name; ++count)
      size += SizeOf(fields[count].quantity);
    const std::span<const Field> together = fields.first(count);
    fields = fields.subspan(count);
    const Field& first = together[0];
    const YamlReader child =
        first.is_optional ? map.Child(first.name) : map.RequireChild(first.name);
    Eigen::VectorXd numbers(size);
    Eigen::Matrix3d matrix;
    if (in_rows && size == matrix.size()) {
      if (!ReadMatrix(child, 3, &matrix)) continue;
      numbers = matrix.transpose().reshaped();
    } else if (!ReadNumbers(child, {numbers.data(), static_cast<std::size_t>(size)})) {
      continue;
    }
    if (!numbers.allFinite()) YamlReader(child).Fail("expected finite numbers");
    stated.merge(StatedTogether(together, numbers.data()));
  }
  return stated;
}

double RmsOfAxes(const Eigen::Vector3d& density) { return density.norm() / std::sqrt(3.0); }

Result<std::optional<NoiseDensities>> NoiseOf(const ExportOptions& options, Triad triad) {
  using Found = std::optional<NoiseDensities>;
  const AllanTriad* const found = options.allan ? options.allan->Find(triad) : nullptr;
  if (found == nullptr) return Found();
  TRUETRIAD_ASSIGN_OR_RETURN(const double truth_per_raw, TruthPerRaw(*found));
  NoiseDensities noise;
  noise.rate_hz = found->rate_hz;
  noise.random_walk.emplace();
  for (int axis = 0; axis < 3; ++axis) {
    const AllanAxis& item = found->axes[static_cast<std::size_t>(axis)];
    if (!item.white_density) return Found();
    noise.white[axis] = truth_per_raw * item.white_density->value;
    if (!item.random_walk) noise.random_walk.reset();
    if (noise.random_walk) (*noise.random_walk)[axis] = truth_per_raw * item.random_walk->value;
  }
  return Found(noise);
}

}  // namespace truetriad
