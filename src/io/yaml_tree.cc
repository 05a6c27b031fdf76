// SPDX-License-Identifier: Apache-2.0
#include <charconv>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <utility>

#include <yaml-cpp/yaml.h>

#include "io/calibration_tree.h"

namespace truetriad {
namespace {

// From this size on, whole numbers written with 17 digits have an exponent.
constexpr double kMostWhole = 1e17;

template <typename Number>
bool IsAll(std::string_view text, Number* number) {
  const auto read = std::from_chars(text.data(), text.data() + text.size(), *number);
  return read.ec == std::errc() && read.ptr == text.data() + text.size();
}

Json PlainTree(const std::string& word) {
  if (word == "true") return true;
  if (word == "false") return false;
  if (word == ".nan" || word == ".inf" || word == "-.inf") return nullptr;
  if (std::int64_t whole = 0; IsAll(word, &whole)) return whole;
  // Words that C++ would read as numbers but YAML does not, such as `inf`, stay texts.
  const bool may_be_number = word.find_first_not_of("0123456789+-.eE") == std::string::npos;
  if (double number = 0.0; may_be_number && IsAll(word, &number)) return number;
  return word;
}

/// The node as JSON. Once `values_left` values are used up, all further values are null.
Json TreeOf(const YAML::Node& node, std::size_t* values_left) {
  if (*values_left == 0 || --*values_left == 0) return nullptr;
  if (node.IsMap()) {
    Json map = Json::object();
    for (const auto& item : node) map[item.first.Scalar()] = TreeOf(item.second, values_left);
    return map;
  }
  if (node.IsSequence()) {
    Json list = Json::array();
    for (const YAML::Node& item : node) list.push_back(TreeOf(item, values_left));
    return list;
  }
  if (!node.IsScalar()) return nullptr;
  const bool was_quoted = node.Tag() == "!";
  return was_quoted ? Json(node.Scalar()) : PlainTree(node.Scalar());
}

}  // namespace

Json AsInYaml(Json tree) {
  if (tree.is_number_float()) {
    const double number = tree.get<double>();
    if (!std::isfinite(number)) return nullptr;
    const bool is_whole = std::trunc(number) == number && std::abs(number) < kMostWhole;
    return is_whole ? Json(static_cast<std::int64_t>(number)) : tree;
  }
  if (tree.is_structured()) {
    for (Json& item : tree) item = AsInYaml(std::move(item));
  }
  return tree;
}

Json TreeOfYaml(const std::string& text) {
  // Each value takes at least one character, except those that an alias repeats.
  std::size_t values_left = text.size() + 2;
  try {
    Json tree = TreeOf(YAML::Load(text), &values_left);
    if (values_left > 0) return tree;
  } catch (const YAML::Exception&) {
    // The text below `config:`, which a user may have written, may be valid YAML only together with
    // the lines above it.
  }
  return text;
}

}  // namespace truetriad
