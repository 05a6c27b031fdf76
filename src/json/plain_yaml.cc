// SPDX-License-Identifier: Apache-2.0
#include "json/plain_yaml.h"

#include <charconv>
#include <cstdint>
#include <string>
#include <vector>

#include <glog/logging.h>

#include "base/utf8.h"

namespace truetriad {
namespace {

struct Line {
  std::size_t indent = 0;
  std::string_view text;  // without indentation and comment
};

bool IsBlank(char c) { return c == ' '; }

std::string_view Trimmed(std::string_view text) {
  while (!text.empty() && IsBlank(text.front())) text.remove_prefix(1);
  while (!text.empty() && IsBlank(text.back())) text.remove_suffix(1);
  return text;
}

// A comment begins at a # that follows a blank, or begins the line, outside quotes.
std::string_view WithoutComment(std::string_view text) {
  bool is_quoted = false;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (is_quoted && text[i] == '\\') {
      ++i;
    } else if (text[i] == '"') {
      is_quoted = !is_quoted;
    } else if (!is_quoted && text[i] == '#' && (i == 0 || IsBlank(text[i - 1]))) {
      return text.substr(0, i);
    }
  }
  return text;
}

std::vector<Line> LinesOf(std::string_view text) {
  std::vector<Line> lines;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    const std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    const std::size_t indent = std::min(line.find_first_not_of(' '), line.size());
    const std::string_view content = Trimmed(WithoutComment(line.substr(indent)));
    if (!content.empty()) lines.push_back({indent, content});
  }
  return lines;
}

template <typename Number>
bool IsAll(std::string_view text, Number* number) {
  const auto read = std::from_chars(text.data(), text.data() + text.size(), *number);
  return read.ec == std::errc() && read.ptr == text.data() + text.size();
}

Json Plain(std::string_view word) {
  if (word.empty() || word == "null" || word == "~") return nullptr;
  if (word == "true") return true;
  if (word == "false") return false;
  if (word == ".nan" || word == ".inf" || word == "-.inf") return nullptr;
  if (std::int64_t whole = 0; IsAll(word, &whole)) return whole;
  const bool may_be_number = word.find_first_not_of("0123456789+-.eE") == std::string_view::npos;
  if (double number = 0.0; may_be_number && IsAll(word, &number)) return number;
  return word;
}

// What follows `key:` or `- ` in a line, from left to right.
class Flow {
 public:
  explicit Flow(std::string_view text) : text_(text) {}

  Json Whole() {
    Json value = Value("");
    CHECK_EQ(Trimmed(text_), "") << "a YAML value has a tail";
    return value;
  }

  // A word up to any of `ends` or the end of the line.
  std::string Word(std::string_view ends, bool* was_quoted) {
    SkipBlanks();
    *was_quoted = !text_.empty() && text_.front() == '"';
    if (*was_quoted) return Quoted();
    std::size_t end = 0;
    while (end < text_.size() && ends.find(text_[end]) == std::string_view::npos) ++end;
    const std::string_view word = Trimmed(text_.substr(0, end));
    text_.remove_prefix(end);
    return std::string(word);
  }

 private:
  Json Value(std::string_view ends) {
    SkipBlanks();
    if (Takes('[')) {
      Json list = Json::array();
      while (!Takes(']')) {
        list.push_back(Value(",]"));
        Takes(',');
      }
      return list;
    }
    if (Takes('{')) {
      Json map = Json::object();
      while (!Takes('}')) {
        bool was_quoted = false;
        std::string name = Word(":", &was_quoted);
        CHECK(Takes(':')) << "a YAML map without a colon";
        map[std::move(name)] = Value(",}");
        Takes(',');
      }
      return map;
    }
    bool was_quoted = false;
    std::string word = Word(ends, &was_quoted);
    return was_quoted ? Json(std::move(word)) : Plain(word);
  }

  std::string Quoted() {
    std::string text;
    std::size_t i = 1;
    for (; text_[i] != '"'; ++i) {
      CHECK_LT(i + 1, text_.size()) << "a YAML string without an end";
      if (text_[i] != '\\') {
        text += text_[i];
      } else if (text_[++i] == 'x' || text_[i] == 'u') {
        const std::size_t digits = text_[i] == 'x' ? 2 : 4;
        CHECK_LT(i + digits, text_.size()) << "a YAML string without an end";
        unsigned code = 0;
        std::from_chars(&text_[i + 1], &text_[i + 1] + digits, code, 16);
        AppendUtf8(code, &text);
        i += digits;
      } else {
        text += text_[i];
      }
    }
    text_.remove_prefix(i + 1);
    return text;
  }

  void SkipBlanks() {
    while (!text_.empty() && IsBlank(text_.front())) text_.remove_prefix(1);
  }
  bool Takes(char c) {
    SkipBlanks();
    CHECK(!text_.empty() || (c != ']' && c != '}')) << "a YAML list or map without an end";
    if (text_.empty() || text_.front() != c) return false;
    text_.remove_prefix(1);
    return true;
  }

  std::string_view text_;
};

class Blocks {
 public:
  explicit Blocks(std::vector<Line> lines) : lines_(std::move(lines)) {}

  Json All() {
    Json all = at_ < lines_.size() ? Block(lines_[at_].indent) : Json::object();
    CHECK_EQ(at_, lines_.size()) << "a YAML text with odd indentation";
    return all;
  }

 private:
  static bool IsItem(std::string_view text) { return text == "-" || text.starts_with("- "); }

  Json Block(std::size_t indent) {
    if (IsItem(lines_[at_].text)) return Items(indent);
    if (KeyEnd(lines_[at_].text) == std::string_view::npos) return Flow(lines_[at_++].text).Whole();
    Json map = Json::object();
    while (at_ < lines_.size() && lines_[at_].indent == indent && !IsItem(lines_[at_].text)) {
      const std::string_view text = lines_[at_].text;
      const std::size_t colon = KeyEnd(text);
      CHECK_NE(colon, std::string_view::npos) << "a YAML line without a key: " << text;
      bool was_quoted = false;
      std::string name = Flow(text.substr(0, colon)).Word("", &was_quoted);
      const std::string_view rest = Trimmed(text.substr(colon + 1));
      if (rest.empty()) {
        ++at_;
        map[std::move(name)] = Below(indent);
      } else {
        ++at_;
        map[std::move(name)] = Flow(rest).Whole();
      }
    }
    return map;
  }

  // What belongs to a key with nothing behind it: deeper lines, or items as deep as the key.
  Json Below(std::size_t indent) {
    if (at_ == lines_.size()) return nullptr;
    const Line& next = lines_[at_];
    if (next.indent > indent || (next.indent == indent && IsItem(next.text))) {
      return Block(next.indent);
    }
    return nullptr;
  }

  Json Items(std::size_t indent) {
    Json list = Json::array();
    while (at_ < lines_.size() && lines_[at_].indent == indent && IsItem(lines_[at_].text)) {
      Line& line = lines_[at_];
      // The item's own block begins where its text does.
      const std::size_t inner = std::min(line.text.find_first_not_of(' ', 1), line.text.size());
      line = {indent + inner, line.text.substr(inner)};
      list.push_back(Block(line.indent));
    }
    return list;
  }

  // Where the key of a line of a block ends: at a colon that a blank or nothing follows.
  static std::size_t KeyEnd(std::string_view text) {
    if (text.front() == '[' || text.front() == '{') return std::string_view::npos;
    std::size_t at = 0;
    if (text.front() == '"') {
      for (at = 1; at < text.size() && text[at] != '"'; ++at) at += text[at] == '\\' ? 1 : 0;
      ++at;
    }
    for (; at < text.size(); ++at) {
      if (text[at] == ':' && (at + 1 == text.size() || IsBlank(text[at + 1]))) return at;
      if (text.front() == '"') return std::string_view::npos;
    }
    return std::string_view::npos;
  }

  std::vector<Line> lines_;
  std::size_t at_ = 0;
};

}  // namespace

Json JsonOfPlainYaml(std::string_view text) { return Blocks(LinesOf(text)).All(); }

}  // namespace truetriad
