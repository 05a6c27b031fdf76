// SPDX-License-Identifier: Apache-2.0
#include "truetriad/model/triad_model.h"

namespace truetriad {

std::string WithArticle(std::string_view words) {
  constexpr std::string_view kVowels = "aeiou";
  const bool has_vowel = !words.empty() && kVowels.find(words.front()) != std::string_view::npos;
  return std::string(has_vowel ? "an " : "a ").append(words);
}

}  // namespace truetriad
