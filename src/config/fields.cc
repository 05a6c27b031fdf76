// SPDX-License-Identifier: Apache-2.0
#include "config/fields.h"

namespace truetriad {

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

void FieldWriter::Line(std::string_view key, const std::string& text, std::string_view mark) {
  if (text.empty()) return;
  if (is_flow_) {
    text_.append(text_.empty() ? "" : ", ").append(key).append(": ").append(text);
    return;
  }
  if (mark.empty() && !given_->contains(path_ + std::string(key))) mark = "  # default";
  text_.append(2 * depth_, ' ').append(key).append(": ").append(text).append(mark) += '\n';
}

}  // namespace truetriad
