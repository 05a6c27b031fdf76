// SPDX-License-Identifier: Apache-2.0
#include "io/yaml_reader.h"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <utility>

#include "base/spelling.h"
#include "base/utf8.h"
#include "io/input_guard.h"
namespace truetriad {
namespace {

/// Reads `text` as a number; false if it is anything else, or a number with more text after it.
template <typename T>
bool ParseWhole(std::string_view text, T* value) {
  if (text.size() > 1 && text[0] == '+' && text[1] != '-') text.remove_prefix(1);
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), *value);
  return error == std::errc() && end == text.data() + text.size();
}

std::string Join(const std::set<std::string, std::less<>>& words) {
  std::string joined;
  for (const std::string& word : words) joined += (joined.empty() ? "" : ", ") + word;
  return joined;
}

/// The number, from 1, of the first line that is indented by a tab; 0 if there is none.
int LineIndentedByTab(const std::string& text) {
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.substr(0, line.find_first_not_of(" \t")).find('\t') != std::string::npos)
      return number;
  }
  return 0;
}

/// A hint, "; …", if a name such as `time[s]` is inside braces or brackets, on the line where
/// reading ended (number `ended`, counted from 0) or on the line before. Otherwise empty.
std::string HintOfBrackets(const std::string& text, int ended) {
  std::istringstream lines(text);
  std::string line;
  for (int number = 0; number <= ended && std::getline(lines, line); ++number) {
    if (number + 1 < ended) continue;
    bool is_inside = false;
    for (std::size_t i = 0; i < line.size(); ++i) {
      const bool is_name = i > 0 && std::isalnum(static_cast<unsigned char>(line[i - 1])) != 0;
      if (is_inside && is_name && line[i] == '[') {
        return "; within {…} and […] a name with brackets needs quotes: 'time[s]'";
      }
      is_inside |= line[i] == '{' || (line[i] == '[' && !is_name);
    }
  }
  return "";
}

}  // namespace

Result<std::string> LookAtSmallFile(const std::string& path) {
  // A calibration of a hundred poses has about 100 kB. If a log is given by mistake, it is far
  // larger.
  constexpr std::uintmax_t kMaxBytes = 64U << 20;
  std::error_code failure;
  if (std::filesystem::is_directory(path, failure)) {
    const std::string within = (std::filesystem::path(path) / "calibration.yaml").string();
    return Error(
        ErrorCode::kUnreadableFile,
        {path},
        "is a folder; give " + (std::filesystem::exists(within, failure) ? within : "a file"));
  }
  // Opening a pipe would block until another process writes to it.
  if (std::filesystem::exists(path, failure) && !std::filesystem::is_regular_file(path, failure)) {
    return Error(ErrorCode::kUnreadableFile, {path}, "is not a regular file");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, failure);
  std::ifstream file(path, std::ios::binary);
  if (failure || !file) {
    return Error(ErrorCode::kUnreadableFile,
                 {path},
                 "cannot be read: " + (failure ? failure.message() : std::strerror(errno)));
  }
  if (size > kMaxBytes) {
    return Error(ErrorCode::kWrongFormat,
                 {path},
                 "has " + std::to_string(size) +
                     " bytes, too many for a YAML file written by hand; is it a log?");
  }
  std::ostringstream text;
  text << file.rdbuf();
  return text.str();
}

Result<std::string> ReadSmallFile(const std::string& path) {
  InputGuard::Add(path);
  return LookAtSmallFile(path);
}

YamlReader::YamlReader(const YAML::Node& node,
                       bool present,
                       std::string name,
                       std::shared_ptr<Shared> shared)
    : node_(node), present_(present), name_(std::move(name)), shared_(std::move(shared)) {}

Result<YamlReader> YamlReader::FromFile(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(const std::string text, ReadSmallFile(path));
  return FromText(text, path);
}

Result<YamlReader> YamlReader::FromText(const std::string& text, const std::string& name) {
  if (text.find('\0') != std::string::npos) {
    return Error(ErrorCode::kWrongFormat, {name}, "is a binary file; expected YAML text");
  }
  auto shared = std::make_shared<Shared>();
  shared->file = name;
  try {
    YamlReader reader(YAML::Load(text), true, "", shared);
    if (!reader.IsMap()) {
      return Error(ErrorCode::kBadYaml,
                   {name},
                   "is not a YAML map; expected lines of the form `key: value`: is another file in "
                   "its place?");
    }
    std::set<int> visited;
    std::set<int> ancestors;
    reader.RejectDuplicates(&visited, &ancestors);
    TRUETRIAD_RETURN_IF_ERROR(reader.status());
    return reader;
  } catch (const YAML::Exception& exception) {
    if (const int line = LineIndentedByTab(text); line > 0) {
      return Error(ErrorCode::kBadYaml,
                   {name, line},
                   "is indented by a tab, which YAML forbids; use spaces");
    }
    return Error(ErrorCode::kBadYaml,
                 {name, exception.mark.line + 1, exception.mark.column + 1},
                 "is not valid YAML: " + exception.msg + HintOfBrackets(text, exception.mark.line));
  }
}

void YamlReader::RejectDuplicates(std::set<int>* visited, std::set<int>* ancestors) {
  // yaml-cpp 0.7 silently keeps the first of two equal keys. An alias gives the same node again.
  // Each node is visited only once, since nested aliases would otherwise take exponential time.
  if (node_.IsScalar()) return;
  const int position = node_.Mark().pos;
  if (!ancestors->insert(position).second) {
    Fail("contains an alias of itself");
    return;
  }
  if (!visited->insert(position).second) {
    ancestors->erase(position);
    return;
  }
  if (node_.IsSequence()) {
    for (YamlReader& item : Items()) item.RejectDuplicates(visited, ancestors);
  } else if (node_.IsMap()) {
    std::set<std::string, std::less<>> seen;
    for (const auto& entry : node_) {
      YamlReader key(entry.first, true, name_, shared_);
      if (!entry.first.IsScalar()) {
        key.Fail("a key must be plain text");
        continue;
      }
      const std::string& text = entry.first.Scalar();
      key.name_ += (name_.empty() ? "" : ".") + text;
      if (!seen.insert(text).second) key.Fail("is given twice; keep one", ErrorCode::kDuplicateKey);
      YamlReader(entry.second, true, key.name_, shared_).RejectDuplicates(visited, ancestors);
    }
  }
  ancestors->erase(position);
}

YamlReader YamlReader::Child(std::string_view key) {
  asked_.emplace(key);
  std::string name = name_ + (name_.empty() ? "" : ".") + std::string(key);
  if (IsMap()) {
    for (const auto& entry : node_) {
      if (entry.first.Scalar() == key) return {entry.second, true, std::move(name), shared_};
    }
  }
  return {node_, false, std::move(name), shared_};
}

YamlReader YamlReader::RequireChild(std::string_view key) {
  YamlReader child = Child(key);
  // If the parent itself is missing, that error has been recorded already.
  if (!child && IsMap()) child.Fail("is missing", ErrorCode::kMissingKey);
  if (present_ && !IsMap()) Fail("expected a map with the key `" + std::string(key) + "`");
  return child;
}

bool YamlReader::ReadScalar(std::string_view expected, std::string* text) {
  if (!present_) return false;
  if (!node_.IsScalar()) {
    Fail(std::string(node_.IsNull() ? "has no value; expected " : "is a map or list; expected ") +
         std::string(expected));
    return false;
  }
  *text = node_.Scalar();
  return true;
}

bool YamlReader::Read(std::string* value) { return ReadScalar("text", value); }

bool YamlReader::ReadName(std::string* value, std::size_t longest) {
  std::string text;
  if (!ReadScalar("text", &text)) return false;
  if (std::any_of(
          text.begin(), text.end(), [](unsigned char c) { return c < 0x20 || c == 0x7F; })) {
    Fail("has a line break or another control character; expected one line of text");
    return false;
  }
  // Length is that of the escaped text, in which a byte that is not UTF-8 takes four characters.
  if (const std::size_t size = AsUtf8(text).size(); size > longest) {
    Fail("has " + std::to_string(size) + " characters; expected at most " +
         std::to_string(longest));
    return false;
  }
  *value = std::move(text);
  return true;
}

bool YamlReader::Read(double* value) {
  std::string text;
  if (!ReadScalar("a number", &text)) return false;
  double number = 0.0;
  if (!ParseWhole(text, &number) || !std::isfinite(number)) {
    Fail("`" + text + "` is not a finite number");
    return false;
  }
  *value = number;
  return true;
}

bool YamlReader::Read(std::int64_t* value) {
  std::string text;
  if (!ReadScalar("a whole number", &text)) return false;
  std::int64_t number = 0;
  if (!ParseWhole(text, &number)) {
    Fail("`" + text + "` is not a whole number");
    return false;
  }
  *value = number;
  return true;
}

bool YamlReader::Read(int* value) {
  std::int64_t number = 0;
  if (!Read(&number)) return false;
  if (number < std::numeric_limits<int>::min() || number > std::numeric_limits<int>::max()) {
    Fail(std::to_string(number) + " is too large");
    return false;
  }
  *value = static_cast<int>(number);
  return true;
}

bool YamlReader::Read(bool* value) {
  std::string text;
  if (!ReadScalar("true or false", &text)) return false;
  if (text != "true" && text != "false") {
    Fail("`" + text + "` is neither true nor false");
    return false;
  }
  *value = text == "true";
  return true;
}

bool YamlReader::Read(std::vector<double>* value) {
  if (!present_) return false;
  if (!node_.IsSequence()) {
    Fail("expected a list of numbers");
    return false;
  }
  std::vector<double> numbers;
  for (YamlReader& item : Items()) {
    double number = 0.0;
    if (!item.Read(&number)) return false;
    numbers.push_back(number);
  }
  *value = std::move(numbers);
  return true;
}

bool YamlReader::Read(Eigen::Vector3d* value) {
  std::vector<double> numbers;
  if (!Read(&numbers)) return false;
  if (numbers.size() != 3) {
    Fail("has " + std::to_string(numbers.size()) + " numbers; expected three: [x, y, z]");
    return false;
  }
  *value = Eigen::Vector3d::Map(numbers.data());
  return true;
}

std::vector<YamlReader> YamlReader::Items() {
  std::vector<YamlReader> items;
  if (!present_) return items;
  if (!node_.IsSequence()) {
    Fail("expected a list");
    return items;
  }
  for (const YAML::Node& item : node_) {
    items.push_back({item, true, name_ + "[" + std::to_string(items.size()) + "]", shared_});
  }
  return items;
}

std::vector<std::string> YamlReader::Keys() {
  std::vector<std::string> keys;
  if (!present_) return keys;
  if (!node_.IsMap()) {
    Fail("expected a map");
    return keys;
  }
  for (const auto& entry : node_) keys.push_back(entry.first.Scalar());
  return keys;
}

void YamlReader::RejectUnknown() {
  if (!present_) return;
  if (!node_.IsMap()) {
    Fail("expected a map with some of the keys " + Join(asked_));
    return;
  }
  for (const auto& entry : node_) {
    const std::string& key = entry.first.Scalar();
    if (asked_.contains(key)) continue;
    YamlReader(entry.first, true, name_ + (name_.empty() ? "" : ".") + key, shared_)
        .Fail("is not a known key; expected one of " + Join(asked_) +
                  DidYouMean(key, {asked_.begin(), asked_.end()}),
              ErrorCode::kUnknownKey);
  }
}

void YamlReader::Fail(const std::string& message, ErrorCode code) {
  shared_->errors.push_back(ErrorHere(code, message));
}

Error YamlReader::ErrorHere(ErrorCode code, const std::string& message) const {
  return Error(code,
               {shared_->file, line(), node_.Mark().column + 1},
               (name_.empty() ? "" : name_ + ": ") + message)
      .About(name_);
}

std::string YamlReader::Place() const {
  return shared_->file + ":" + std::to_string(line()) + ": " + (name_.empty() ? "" : name_ + ": ");
}

Status YamlReader::status() const {
  if (shared_->errors.empty()) return {};
  return Joined(shared_->errors);
}

}  // namespace truetriad
