// SPDX-License-Identifier: Apache-2.0
//
// Converts JSON files to a recording. docs/converting.md.
#include "tree/json.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tools/convert/common/named_readings.h"

namespace truetriad::convert {
namespace {

constexpr int kDeepest = 8;  ///< Levels of nested objects; deeper ones are left out.

double NumberOf(const Json* value) {
  const bool is_one = value != nullptr && value->is_number();
  return is_one ? value->get<double>() : std::numeric_limits<double>::quiet_NaN();
}

bool AreNumbers(const Json& list) {
  return std::all_of(list.begin(), list.end(), [](const Json& item) {
    return item.is_number() || item.is_null();
  });
}

/// The matrix whose rows are numbers, or lists of equally many numbers; null and missing values
/// become NaN. Nullopt: the rows are anything else.
std::optional<Matrix> MatrixOf(const std::vector<const Json*>& rows) {
  std::size_t columns = 0;
  for (const Json* row : rows) {
    if (row == nullptr || row->is_null()) continue;
    const bool is_list = row->is_array() && AreNumbers(*row);
    if (!is_list && !row->is_number()) return std::nullopt;
    const std::size_t width = is_list ? row->size() : 1;
    if (width == 0 || (columns != 0 && width != columns)) return std::nullopt;
    columns = width;
  }
  if (columns == 0) return std::nullopt;
  Matrix matrix{.rows = rows.size(), .columns = columns, .values = {}};
  for (std::size_t k = 0; k < columns; ++k) {
    for (const Json* row : rows) {
      const bool is_list = row != nullptr && row->is_array();
      matrix.values.push_back(NumberOf(is_list ? &(*row)[k] : row));
    }
  }
  return matrix;
}

/// The fields of records by name: for each record its value, or nullptr if it lacks the field.
using Fields = std::map<std::string, std::vector<const Json*>>;

void CollectFields(const Json& record,
                   const std::string& prefix,
                   std::size_t row,
                   std::size_t rows,
                   int depth,
                   Fields* fields) {
  for (const auto& [key, value] : record.items()) {
    const std::string name = prefix + key;
    if (value.is_object()) {
      if (depth < kDeepest) CollectFields(value, name + ".", row, rows, depth + 1, fields);
      continue;
    }
    std::vector<const Json*>& values = (*fields)[name];
    values.resize(rows, nullptr);
    values[row] = &value;
  }
}

bool AreRecords(const Json& value) {
  return value.is_array() && !value.empty() &&
         std::all_of(value.begin(), value.end(), [](const Json& item) { return item.is_object(); });
}

void Collect(const Json& value,
             const std::string& name,
             int depth,
             std::map<std::string, Matrix>* matrices) {
  const std::string prefix = name.empty() ? "" : name + ".";
  if (value.is_object() && depth < kDeepest) {
    for (const auto& [key, item] : value.items()) Collect(item, prefix + key, depth + 1, matrices);
  } else if (AreRecords(value)) {
    Fields fields;
    for (std::size_t row = 0; row < value.size(); ++row) {
      CollectFields(value[row], prefix, row, value.size(), depth, &fields);
    }
    for (const auto& [field, values] : fields) {
      if (std::optional<Matrix> matrix = MatrixOf(values)) {
        matrices->emplace(field, *std::move(matrix));
      }
    }
  } else if (value.is_array()) {
    std::vector<const Json*> rows;
    for (const Json& row : value) rows.push_back(&row);
    if (std::optional<Matrix> matrix = MatrixOf(rows)) {
      matrices->emplace(name.empty() ? "data" : name, *std::move(matrix));
    }
  }
}

/// Replaces NaN and infinities, which Python writes but JSON forbids, by null.
std::string WithoutNan(const std::string& text) {
  constexpr std::array<std::string_view, 4> kWords = {"NaN", "Infinity", "-Infinity", "-NaN"};
  std::string clean;
  clean.reserve(text.size());
  bool is_quoted = false;
  for (std::size_t i = 0; i < text.size();) {
    const std::string_view rest(text.data() + i, text.size() - i);
    const auto* const word = std::find_if(
        kWords.begin(), kWords.end(), [&](std::string_view w) { return rest.starts_with(w); });
    if (!is_quoted && word != kWords.end()) {
      clean += "null";
      i += word->size();
      continue;
    }
    if (is_quoted && text[i] == '\\' && i + 1 < text.size()) clean += text[i++];
    if (text[i] == '"') is_quoted = !is_quoted;
    clean += text[i++];
  }
  return clean;
}

/// Parses JSON. If an object has a name twice, `twice` receives the name; otherwise it is
/// unchanged.
Json ParseOnce(const std::string& text, std::string* twice) {
  std::vector<std::set<std::string>> names;
  const auto look = [&](int /*depth*/, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::object_start) names.emplace_back();
    if (event == Json::parse_event_t::object_end) names.pop_back();
    if (event == Json::parse_event_t::key) {
      const std::string name = parsed.get<std::string>();
      if (!names.back().insert(name).second) *twice = name;
    }
    return true;
  };
  return Json::parse(text, look);
}

/// Parses a text with one object or one list of numbers on each line. Nullopt: any other text.
std::optional<Json> ParseLines(const std::string& text) {
  Json records = Json::array();
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    Json record = Json::parse(line, nullptr, /*allow_exceptions=*/false);
    const bool is_row = record.is_array() && AreNumbers(record);
    if (!record.is_object() && !is_row) return std::nullopt;
    if (!records.empty() && records[0].is_object() != record.is_object()) return std::nullopt;
    records.push_back(std::move(record));
  }
  if (records.empty()) return std::nullopt;
  return records;
}

/// Reads the numbers of a JSON file. Keys of objects name them: "imu.acc". A list of numbers is a
/// column, a list of lists a matrix. In a list of objects, or a file with one object on each line,
/// each object is a row: {"t": 0, "acc": [1, 2, 3]} gives `t` and `acc`. null, and NaN, which some
/// programs write, stand for missing numbers. Other contents are left out. Error: unreadable, or
/// not JSON.
Result<VariableFile> Open(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::ostringstream content;
  errno = 0;
  if (!file || !(content << file.rdbuf())) {
    if (file.is_open() && errno == 0)
      return Error(ErrorCode::kEmptyFile, {path}, "is empty; expected JSON with readings");
    return Error(
        ErrorCode::kUnreadableFile, {path}, std::string("cannot be read: ") + std::strerror(errno));
  }
  const std::string text = WithoutNan(content.str());
  Json json;
  std::string twice;
  try {
    json = ParseOnce(text, &twice);
    if (!twice.empty()) {
      return Error(ErrorCode::kDuplicateKey, {path}, "`" + twice + "` occurs twice in one object");
    }
  } catch (const Json::out_of_range&) {
    return Error(ErrorCode::kValueOutOfRange, {path}, "has a number that is too large");
  } catch (const Json::parse_error& failure) {
    std::optional<Json> lines = ParseLines(text);
    if (!lines) {
      const std::size_t at = std::min(failure.byte, text.size());
      const auto end = text.begin() + static_cast<std::ptrdiff_t>(at);
      return Error(ErrorCode::kWrongFormat,
                   {path, 1 + std::count(text.begin(), end, '\n')},
                   "is not valid JSON from here on (after " + std::to_string(at) + " characters)");
    }
    json = *std::move(lines);
  }
  std::map<std::string, Matrix> matrices;
  Collect(json, "", 0, &matrices);
  VariableFile variables;
  for (const auto& [name, matrix] : matrices) {
    variables.variables.push_back({name, "numbers", matrix.rows, matrix.columns, [matrix = matrix] {
                                     return Result<Matrix>(matrix);
                                   }});
  }
  return variables;
}

constexpr NamedFormat kFormat = {.name = "json", .open = Open};

}  // namespace
}  // namespace truetriad::convert

int main(int argc, char** argv) {
  return truetriad::convert::RunNamedReadingsConverter(truetriad::convert::kFormat, argc, argv);
}
