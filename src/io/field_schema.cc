// SPDX-License-Identifier: Apache-2.0
#include "io/field_schema.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/unit_names.h"
#include "io/calibration_tree.h"

namespace truetriad {
namespace {

/// States a bound of a range. If `number` is the double next to a whole number, such as the
/// smallest one above zero, the whole number is stated as an exclusive bound.
void State(const char* bound, const char* exclusive, double number, double beyond, Json* schema) {
  if (!std::isfinite(number)) return;
  const double next = std::nextafter(number, beyond);
  const bool is_next = std::trunc(number) != number && std::trunc(next) == next;
  (*schema)[is_next ? exclusive : bound] = AsInYaml(is_next ? next : number);
}

bool IsWords(const Json& schema) { return schema.size() == 1 && schema.contains("enum"); }

void AddAlternative(const Json& schema, Json* all) {
  const auto same = std::find_if(all->begin(), all->end(), [&schema](const Json& other) {
    return other == schema || (IsWords(other) && IsWords(schema));
  });
  if (same == all->end()) {
    all->push_back(schema);
  } else if (*same != schema) {
    Json& words = (*same)["enum"];
    for (const Json& word : schema["enum"]) {
      if (std::find(words.begin(), words.end(), word) == words.end()) words.push_back(word);
    }
  }
}

Json ThreeOf(const Json& items) {
  Json list = ListSchema(items);
  list["minItems"] = list["maxItems"] = 3;
  return list;
}

}  // namespace

Json AnyOf(const Json& first, const Json& second) {
  Json all = Json::array();
  for (const Json& schema : {first, second}) {
    if (!schema.contains("anyOf")) AddAlternative(schema, &all);
    for (const Json& each : schema.value("anyOf", Json::array())) AddAlternative(each, &all);
  }
  return all.size() == 1 ? all[0] : Json{{"anyOf", all}};
}

Json WordSchema(const std::vector<std::string_view>& words) {
  Json list = Json::array();
  for (const std::string_view word : words) {
    const bool is_true = word == "true";
    list.push_back(is_true || word == "false" ? Json(is_true) : Json(word));
  }
  return {{"enum", list}};
}

Json RangeSchema(const Range& range, std::string_view type) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Json schema = {{"type", type}};
  if (!range.expected.empty()) schema["description"] = range.expected;
  State("minimum", "exclusiveMinimum", range.lowest, -kInfinity, &schema);
  State("maximum", "exclusiveMaximum", range.highest, kInfinity, &schema);
  return schema;
}

Json ListSchema(const Json& items) { return {{"type", "array"}, {"items", items}}; }

Json SchemaOf(const Entries& entries, const Eigen::Vector3d*) {
  const Json one = RangeSchema(entries.range, "number");
  return entries.may_be_one ? AnyOf(one, ThreeOf(one)) : ThreeOf(one);
}
Json SchemaOf(const Entries& entries, const Eigen::Matrix3d*) {
  const Json one = RangeSchema(entries.range, "number"), rows = ThreeOf(ThreeOf(one));
  return entries.may_be_one ? AnyOf(one, rows) : rows;
}
Json SchemaOf(BodyAxis, const Eigen::Vector3d*) {
  return AnyOf(WordSchema({"x", "y", "z", "-x", "-y", "-z", "+x", "+y", "+z"}),
               SchemaOf(kNumbers, static_cast<const Eigen::Vector3d*>(nullptr)));
}
Json SchemaOf(NumberList, const std::vector<double>*) {
  return ListSchema(RangeSchema(kAnyNumber, "number"));
}
// Plain numbers and truth values of YAML, such as a serial number 123, are texts as well.
Json SchemaOf(const Text&, const std::string*) {
  return {{"type", {"string", "number", "boolean"}}};
}
Json SchemaOf(FormatVersion, const int*) { return {{"const", kVersion}}; }
Json SchemaOf(Flag, const bool*) { return {{"type", "boolean"}}; }
Json SchemaOf(const OnlyWord& word, const OnlyWord*) { return WordSchema({word.word}); }
Json SchemaOf(Seed, const std::uint64_t*) { return {{"type", "integer"}, {"minimum", 0}}; }
Json SchemaOf(const ReadingsUnit& kind, const Unit*) {
  return WordSchema(TriadUnitNames(kind.triad));
}
Json SchemaOf(const StatedNumber& kind, const Stated*) {
  const Json map = FieldSchema::OfMap([&kind](FieldSchema& visit) {
    visit("value", double(), kind.range);
    visit("sigma", double(), kNotNegative);
  });
  const Json number = AnyOf(RangeSchema(kind.range, "number"), map);
  return kind.may_be_unknown ? AnyOf(WordSchema({"unknown"}), number) : number;
}

void FieldSchema::Add(std::string_view key, const Json& schema) {
  Json& known = properties_[std::string(key)];
  if (known.empty()) {
    known = schema;
  } else if (!schema.empty()) {
    known = AnyOf(known, schema);
  }
}

Json FieldSchema::Taken(const std::vector<MapWord>& words) const {
  Json map = {{"type", "object"}, {"properties", properties_}, {"additionalProperties", false}};
  for (const std::string& key : required_[0]) {
    const auto has_key = [&key](const auto& keys) { return keys.contains(key); };
    if (std::all_of(required_.begin(), required_.end(), has_key)) map["required"].push_back(key);
  }
  if (words.empty()) return map;
  std::vector<std::string_view> names;
  for (const MapWord& word : words) names.push_back(word.word);
  return AnyOf(WordSchema(names), map);
}

}  // namespace truetriad
