// SPDX-License-Identifier: Apache-2.0
#include "config/fields.h"

namespace truetriad {

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
