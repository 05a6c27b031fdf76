// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "base/named_values.h"
#include "io/yaml_reader.h"
#include "io/yaml_text.h"
#include "truetriad/base/triad.h"

namespace truetriad {

// Kinds of values in files that users write. Each kind of value is read by
//   bool ReadAs(kind, reader, &value)   true if it was read; false if it is missing, or wrong:
//                                       only a wrong value is an error of its file
// and kinds that are written back have
//   std::string TextOf(kind, value)     YAML in one line; empty: the key is left out.

/// A number in a range; the type of the value decides whether it must be whole.
struct Range {
  double lowest = -std::numeric_limits<double>::infinity();
  double highest = std::numeric_limits<double>::infinity();
  std::string_view expected;  ///< For messages: "a positive number".
};
constexpr Range kAnyNumber{.expected = "a number"};
constexpr Range kPositive{.lowest = std::numeric_limits<double>::denorm_min(),
                          .expected = "a positive number"};
constexpr Range kNotNegative{.lowest = 0.0, .expected = "a number of at least zero"};
constexpr Range kTemperatureDegc{kAbsoluteZeroDegc, 1000.0, "a temperature in degC"};
constexpr Range kLatitudeDeg{-90.0, 90.0, "a latitude of -90 to 90 degrees"};
constexpr Range kDeclinationDeg{
    -180.0, 180.0, "a declination of -180 to 180 degrees, east positive"};
constexpr Range kDipDeg{
    -90.0, 90.0, "a dip of -90 to 90 degrees, positive if the field points down"};

bool ReadAs(const Range& range, YamlReader reader, double* value);
bool ReadAs(const Range& range, YamlReader reader, int* value);
bool ReadAs(const Range& range, YamlReader reader, std::int64_t* value);

/// Three numbers, or three rows of three, each in a range.
struct Entries {
  Range range = kAnyNumber;
  bool may_be_one = false;  ///< One number may stand for all.
  bool may_be_inf = false;  ///< `.inf` states that a σ is unlimited.
};
constexpr Entries kNumbers{};
constexpr Entries kEach{kAnyNumber, true};
constexpr Entries kSigmas{kPositive, true, true};

bool ReadAs(const Entries& entries, YamlReader reader, Eigen::Vector3d* value);
bool ReadAs(const Entries& entries, YamlReader reader, Eigen::Matrix3d* value);

/// An axis: x, -x, y, … or a vector other than zero, which is not normalised.
struct BodyAxis {};
bool ReadAs(BodyAxis, YamlReader reader, Eigen::Vector3d* axis);

struct NumberList {};
inline bool ReadAs(NumberList, YamlReader reader, std::vector<double>* value) {
  return reader.Read(value);
}

/// Free text, which is quoted when it is written.
struct Text {
  bool is_name = false;      ///< One line of at most `longest` characters.
  bool is_left_out = false;  ///< An empty text is not written.
  std::size_t longest = YamlReader::kLongestName;
};
constexpr Text kName{.is_name = true};
constexpr Text kAnyText{};
constexpr Text kFile{.is_left_out = true};

bool ReadAs(const Text& text, YamlReader reader, std::string* value);
std::string TextOf(const Text& text, const std::string& value);

/// The version of a file's format; so far there is only version 1.
constexpr int kVersion = 1;
struct FormatVersion {};
bool ReadAs(FormatVersion, YamlReader reader, int* value);

/// `true` or `false`.
struct Flag {};
inline bool ReadAs(Flag, YamlReader reader, bool* value) { return reader.Read(value); }

/// This word and nothing else.
struct OnlyWord {
  std::string_view word;
};
bool ReadAs(const OnlyWord& word, YamlReader reader, const OnlyWord*);
inline std::string TextOf(const OnlyWord& word, const OnlyWord&) { return std::string(word.word); }

/// True when the value is exactly this word.
bool IsWord(YamlReader reader, std::string_view word);

/// A whole number of 64 bits.
struct Seed {};
bool ReadAs(Seed, YamlReader reader, std::uint64_t* value);

/// The unit of a sensor's readings.
struct ReadingsUnit {
  Triad triad;
};
bool ReadAs(const ReadingsUnit& kind, YamlReader reader, Unit* value);

/// A number stated as `number`, `{ value, sigma }` or `unknown`. Holds the parts that were stated.
struct Stated {
  std::optional<double> value;
  std::optional<double> sigma;
};
struct StatedNumber {
  Range range;
  bool may_be_unknown = false;
};
bool ReadAs(const StatedNumber& kind, YamlReader reader, Stated* stated);
std::string TextOf(const StatedNumber& kind, const Stated& stated);

/// The text of a value of any kind, if YamlText itself can write the value.
template <typename Kind, typename Value>
requires requires(YamlText& text, const Value& value) { text << value; }
std::string TextOf(const Kind&, const Value& value) { return (YamlText() << value).str(); }

// Values that are one of several words.

/// A table of enum values and their names. `name` is the function of another layer that returns the
/// name of a value.
template <typename T, typename... More>
auto Named(std::string_view (*name)(T), T first, More... more) {
  return NamedValues<T, 1 + sizeof...(More)>{{{first, name(first)}, {more, name(more)}...}};
}

/// The names of all choices, for messages: "none, estimate".
template <typename T, std::size_t N>
std::string NamesIn(const NamedValues<T, N>& choices) {
  std::string names;
  for (const auto& entry : choices.entries) {
    names += (names.empty() ? "" : ", ") + std::string(entry.second);
  }
  return names;
}

template <typename T, std::size_t N>
bool ReadAs(const NamedValues<T, N>& choices, YamlReader reader, T* value) {
  std::string word;
  if (!reader.Read(&word)) return false;
  if (const std::optional<T> choice = choices.Find(word)) {
    *value = *choice;
    return true;
  }
  reader.Fail("`" + word + "` is unknown; expected one of " + NamesIn(choices));
  return false;
}

template <typename T, std::size_t N>
std::string TextOf(const NamedValues<T, N>& choices, const T& value) {
  return std::string(choices.Name(value));
}

// Kinds that are made of other kinds.

/// An optional value is read only if it is stated, and written only if it is set.
template <typename Kind, typename Value>
bool ReadAs(const Kind& kind, YamlReader reader, std::optional<Value>* value) {
  Value read = value->value_or(Value());
  if (!ReadAs(kind, std::move(reader), &read)) return false;
  *value = read;
  return true;
}
template <typename Kind, typename Value>
std::string TextOf(const Kind& kind, const std::optional<Value>& value) {
  return value ? TextOf(kind, *value) : "";
}

/// A value, or `word`, which leaves the value open. In this case a std::optional is unset; an
/// `Open` has its flag set and gets the value `left_open`.
template <typename Kind, typename Value = int>
struct OrWord {
  Kind kind;
  std::string_view word = "auto";
  Value left_open = {};
};
template <typename Kind>
OrWord(Kind, std::string_view) -> OrWord<Kind>;
template <typename Kind, typename Value>
OrWord(Kind, std::string_view, Value) -> OrWord<Kind, Value>;

template <typename Value>
struct Open {
  Value& value;
  bool& is_open;
};
template <typename Value>
Open(Value&, bool&) -> Open<Value>;

template <typename Kind, typename Any, typename Value>
bool ReadAs(const OrWord<Kind, Any>& kind, YamlReader reader, std::optional<Value>* value) {
  if (!IsWord(reader, kind.word)) return ReadAs(kind.kind, std::move(reader), value);
  value->reset();
  return true;
}
template <typename Kind, typename Any, typename Value>
std::string TextOf(const OrWord<Kind, Any>& kind, const std::optional<Value>& value) {
  return value ? TextOf(kind.kind, *value) : std::string(kind.word);
}
template <typename Kind, typename Value>
bool ReadAs(const OrWord<Kind, Value>& kind, YamlReader reader, const Open<Value>* open) {
  if (IsWord(reader, kind.word)) {
    open->is_open = true;
    open->value = kind.left_open;
    return true;
  }
  if (!ReadAs(kind.kind, reader, &open->value)) return false;
  open->is_open = false;
  return true;
}
template <typename Kind, typename Value>
std::string TextOf(const OrWord<Kind, Value>& kind, const Open<Value>& open) {
  return open.is_open ? std::string(kind.word) : TextOf(kind.kind, open.value);
}

/// A list; it replaces the list of an earlier document. A list of named values may also be read as
/// a set of flags, one for each name.
template <typename Kind>
struct ListOf {
  Kind kind;
};
template <typename Kind>
ListOf(Kind) -> ListOf<Kind>;

template <typename Kind, typename Value>
bool ReadAs(const ListOf<Kind>& list, YamlReader reader, std::vector<Value>* values) {
  if (!reader) return false;
  values->clear();
  for (const YamlReader& item : reader.Items()) ReadAs(list.kind, item, &values->emplace_back());
  return true;
}
template <typename Kind, typename Value>
std::string TextOf(const ListOf<Kind>& list, const std::vector<Value>& values) {
  std::string text;
  for (const Value& value : values) text += (text.empty() ? "" : ", ") + TextOf(list.kind, value);
  return "[" + text + "]";
}
template <typename Flags, typename T>
auto& FlagOf(Flags& flags, T value) {
  if constexpr (requires { flags[value]; }) {
    return flags[value];
  } else {
    return flags[static_cast<std::size_t>(value)];
  }
}
template <typename T, std::size_t N, typename Flags>
bool ReadAs(const ListOf<NamedValues<T, N>>& names, YamlReader reader, Flags* flags) {
  if (!reader) return false;
  if (!reader.IsSequence()) {
    reader.Fail("expected a list of " + NamesIn(names.kind));
    return false;
  }
  *flags = {};
  for (const YamlReader& item : reader.Items()) {
    if (T value{}; ReadAs(names.kind, item, &value)) FlagOf(*flags, value) = true;
  }
  return true;
}
template <typename T, std::size_t N, typename Flags>
std::string TextOf(const ListOf<NamedValues<T, N>>& names, const Flags& flags) {
  std::string text;
  for (const auto& [value, name] : names.kind.entries) {
    if (FlagOf(flags, value)) text.append(text.empty() ? "" : ", ").append(name);
  }
  return "[" + text + "]";
}

/// A map with free names; its values are added to those of an earlier document.
template <typename Kind>
struct MapOf {
  Kind kind;
};
template <typename Kind>
MapOf(Kind) -> MapOf<Kind>;

template <typename Kind, typename Value>
bool ReadAs(const MapOf<Kind>& map, YamlReader reader, std::map<std::string, Value>* values) {
  for (const std::string& key : reader.Keys()) {
    ReadAs(map.kind, reader.Child(key), &(*values)[key]);
  }
  return bool(reader);
}

// Quantities whose keys name the unit, so that values of a data sheet can be copied.

/// One key of a quantity: value in the program's unit = number * scale.
struct QuantityKey {
  std::string key;
  double scale = 1.0;
};
using QuantityKeys = std::vector<QuantityKey>;

/// `stem`_`unit``tail` for every unit of the triad's true quantity: "bias_mps2", "bias_mg", …
QuantityKeys TriadKeys(std::string_view stem, Triad triad, std::string_view tail = "");
/// Keys of a time (`stem`_s, _ms, _us), of a share (`stem`, `stem`_percent, _ppm), of an angle
/// (_rad, _mrad, _deg) and of a rate (_radps, _degps).
QuantityKeys TimeKeys(std::string_view stem);
QuantityKeys ShareKeys(std::string_view stem, std::string_view tail = "");
QuantityKeys AngleKeys(std::string_view stem);
QuantityKeys RateKeys(std::string_view stem);
/// A key that states an angle, or a quantity made of angles, in degrees.
QuantityKeys InDegrees(std::string_view key);

}  // namespace truetriad
