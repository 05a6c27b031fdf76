// SPDX-License-Identifier: Apache-2.0
#include "io/yaml_values.h"

#include <array>
#include <charconv>
#include <span>
#include <system_error>
#include <utility>

#include "io/field_reader.h"

namespace truetriad {
namespace {

bool IsWithin(const Range& range, double number, YamlReader reader) {
  if (number >= range.lowest && number <= range.highest) return true;
  std::string text;
  reader.Read(&text);
  reader.Fail("`" + text + "` is out of range; expected " + std::string(range.expected));
  return false;
}

template <typename Number>
bool ReadNumber(const Range& range, YamlReader reader, Number* value) {
  Number number{};
  if (!reader.Read(&number) || !IsWithin(range, static_cast<double>(number), reader)) return false;
  *value = number;
  return true;
}

bool ReadEntry(const Entries& entries, const YamlReader& reader, double* value) {
  if (!entries.may_be_inf || !IsWord(reader, ".inf")) return ReadAs(entries.range, reader, value);
  *value = std::numeric_limits<double>::infinity();
  return true;
}

template <typename Matrix>
bool ReadEntries(const Entries& entries, YamlReader reader, Matrix* value) {
  constexpr bool kIsVector = Matrix::ColsAtCompileTime == 1;
  if (!reader) return false;
  if (entries.may_be_one && reader.IsScalar()) {
    double one = 0.0;
    if (!ReadEntry(entries, reader, &one)) return false;
    value->setConstant(one);
    return true;
  }
  const std::vector<YamlReader> rows =
      reader.IsSequence() ? reader.Items() : std::vector<YamlReader>();
  if (rows.size() != 3) {
    reader.Fail(std::string("expected ") +
                (kIsVector ? "three numbers [x, y, z]" : "three rows [[a, b, c], …]") +
                (entries.may_be_one ? " or one number for all" : ""));
    return false;
  }
  Matrix result;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const YamlReader& row = rows[static_cast<std::size_t>(i)];
    if constexpr (kIsVector) {
      if (!ReadEntry(entries, row, &result(i))) return false;
    } else {
      Eigen::Vector3d numbers;
      if (!ReadEntries({entries.range, false, entries.may_be_inf}, row, &numbers)) return false;
      result.row(i) = numbers.transpose();
    }
  }
  *value = result;
  return true;
}

using UnitScale = std::pair<std::string_view, double>;

std::span<const UnitScale> UnitsOf(Triad triad) {
  static constexpr std::array<UnitScale, 4> kAccelerometer = {
      {{"mps2", 1.0},
       {"g", kStandardGravityMps2},
       {"mg", kStandardGravityMps2 * 1e-3},
       {"ug", kStandardGravityMps2 * 1e-6}}};
  static constexpr std::array<UnitScale, 3> kGyroscope = {
      {{"radps", 1.0}, {"degps", kRadPerDeg}, {"degph", kRadPerDeg / 3600.0}}};
  static constexpr std::array<UnitScale, 3> kMagnetometer = {
      {{"ut", 1.0}, {"nt", 1e-3}, {"mgauss", 0.1}}};
  switch (triad) {
    case Triad::kAccelerometer:
      return kAccelerometer;
    case Triad::kGyroscope:
      return kGyroscope;
    case Triad::kMagnetometer:
      return kMagnetometer;
  }
  return {};
}

QuantityKeys Keys(std::string_view stem,
                  std::span<const UnitScale> units,
                  std::string_view tail = "") {
  QuantityKeys keys;
  for (const auto& [unit, scale] : units) {
    std::string key(stem);
    if (!unit.empty()) key.append("_").append(unit);
    keys.push_back({key.append(tail), scale});
  }
  return keys;
}

}  // namespace

bool ReadAs(const Range& range, YamlReader reader, double* value) {
  return ReadNumber(range, std::move(reader), value);
}
bool ReadAs(const Range& range, YamlReader reader, int* value) {
  return ReadNumber(range, std::move(reader), value);
}
bool ReadAs(const Range& range, YamlReader reader, std::int64_t* value) {
  return ReadNumber(range, std::move(reader), value);
}

bool ReadAs(const Entries& entries, YamlReader reader, Eigen::Vector3d* value) {
  return ReadEntries(entries, std::move(reader), value);
}
bool ReadAs(const Entries& entries, YamlReader reader, Eigen::Matrix3d* value) {
  return ReadEntries(entries, std::move(reader), value);
}

bool ReadAs(BodyAxis, YamlReader reader, Eigen::Vector3d* axis) {
  if (!reader.IsScalar()) {
    Eigen::Vector3d vector;
    if (!reader.Read(&vector)) return false;
    if (!(vector.norm() > 0.0)) {
      reader.Fail("expected a vector other than zero");
      return false;
    }
    *axis = vector;
    return true;
  }
  std::string name;
  if (!reader.Read(&name)) return false;
  const bool has_sign = name.starts_with('-') || name.starts_with('+');
  const std::size_t place = kAxisLetters.find(name.substr(has_sign ? 1 : 0));
  if (name.size() != (has_sign ? 2U : 1U) || place == std::string::npos) {
    reader.Fail("`" + name + "` is not among x, -x, y, -y, z, -z; or give a vector [x, y, z]");
    return false;
  }
  *axis = (name[0] == '-' ? -1.0 : 1.0) * Eigen::Vector3d::Unit(static_cast<Eigen::Index>(place));
  return true;
}

bool ReadAs(const Text& text, YamlReader reader, std::string* value) {
  return text.is_name ? reader.ReadName(value, text.longest) : reader.Read(value);
}
std::string TextOf(const Text& text, const std::string& value) {
  return text.is_left_out && value.empty() ? "" : (YamlText() << Quoted{value}).str();
}

bool ReadAs(const OnlyWord& word, YamlReader reader, const OnlyWord*) {
  if (!reader || IsWord(reader, word.word)) return bool(reader);
  reader.Fail("expected `" + std::string(word.word) + "`");
  return false;
}

bool ReadAs(FormatVersion, YamlReader reader, int* value) {
  if (!reader.Read(value)) return false;
  if (*value == kVersion) return true;
  reader.Fail("version " + std::to_string(*value) +
              " is not supported; this truetriad reads version " + std::to_string(kVersion));
  return false;
}

bool IsWord(YamlReader reader, std::string_view word) {
  std::string text;
  return reader.IsScalar() && reader.Read(&text) && text == word;
}

bool ReadAs(Seed, YamlReader reader, std::uint64_t* value) {
  std::string text;
  if (!reader.Read(&text)) return false;
  const char* const end = text.data() + text.size();
  const auto [parsed_to, failure] = std::from_chars(text.data(), end, *value);
  if (failure == std::errc() && parsed_to == end) return true;
  reader.Fail("`" + text +
              "` is not a seed; expected a whole number from 0 to 18446744073709551615");
  return false;
}

bool ReadAs(const ReadingsUnit& kind, YamlReader reader, Unit* value) {
  std::string name;
  if (!reader.Read(&name)) return false;
  const Result<Unit> unit = ParseTriadUnit(kind.triad, name);
  if (unit) {
    *value = *unit;
  } else {
    reader.Fail(unit.error().message, unit.error().code);
  }
  return unit.has_value();
}

bool ReadAs(const StatedNumber& kind, YamlReader reader, Stated* stated) {
  if (kind.may_be_unknown && IsWord(reader, "unknown")) {
    *stated = {};
  } else if (reader.IsMap()) {
    ReadAs(kind.range, reader.Child("value"), &stated->value);
    ReadAs(kNotNegative, reader.Child("sigma"), &stated->sigma);
    reader.RejectUnknown();
  } else if (double number = 0.0; ReadAs(kind.range, reader, &number)) {
    *stated = {number, std::nullopt};
  }
  return bool(reader);
}

std::string TextOf(const StatedNumber&, const Stated& stated) {
  if (!stated.value) return "unknown";
  YamlText text;
  if (!stated.sigma) return (text << *stated.value).str();
  return (text << "{ value: " << *stated.value << ", sigma: " << *stated.sigma << " }").str();
}

QuantityKeys TriadKeys(std::string_view stem, Triad triad, std::string_view tail) {
  return Keys(stem, UnitsOf(triad), tail);
}

QuantityKeys TimeKeys(std::string_view stem) {
  return Keys(stem, std::array<UnitScale, 3>{{{"s", 1.0}, {"ms", 1e-3}, {"us", 1e-6}}});
}

QuantityKeys ShareKeys(std::string_view stem, std::string_view tail) {
  return Keys(stem, std::array<UnitScale, 3>{{{"", 1.0}, {"percent", 1e-2}, {"ppm", 1e-6}}}, tail);
}

QuantityKeys AngleKeys(std::string_view stem) {
  return Keys(stem, std::array<UnitScale, 3>{{{"rad", 1.0}, {"mrad", 1e-3}, {"deg", kRadPerDeg}}});
}

QuantityKeys RateKeys(std::string_view stem) {
  return Keys(stem, std::array<UnitScale, 2>{{{"radps", 1.0}, {"degps", kRadPerDeg}}});
}

QuantityKeys InDegrees(std::string_view key) { return {{std::string(key), kRadPerDeg}}; }

std::string FieldReader::PlaceOf(std::string_view key) {
  const std::string place = key.empty() ? map_.Place() : map_.Child(key).Place();
  return place.substr(0, place.find_last_not_of(": ") + 1);
}

void FieldReader::End(const MapForm& form) {
  if (form.words.empty() || !map_.IsScalar()) return map_.RejectUnknown();
  std::string expected;
  for (const MapWord& word : form.words) {
    expected += (expected.empty() ? "`" : ", `") + std::string(word.word) + "`";
  }
  std::string keys;
  for (const std::string& key : keys_) keys += (keys.empty() ? "" : ": …, ") + key;
  map_.Fail("expected " + expected + " or { " + keys + ": … }");
}

}  // namespace truetriad
