// SPDX-License-Identifier: Apache-2.0
#include "config/yaml_values.h"

namespace truetriad {

bool ReadNumber(YamlReader reader, const Range& range, double* value) {
  double number = 0.0;
  if (!reader.Read(&number)) return false;
  if (number < range.lowest || number > range.highest) {
    std::string text;
    reader.Read(&text);
    reader.Fail("`" + text + "` is out of range; expected " + std::string(range.expected));
    return false;
  }
  *value = number;
  return true;
}

bool IsWord(YamlReader reader, std::string_view word) {
  std::string text;
  return reader.IsScalar() && reader.Read(&text) && text == word;
}

bool ReadSigma(YamlReader reader, double* value) {
  if (IsWord(reader, ".inf")) {
    *value = std::numeric_limits<double>::infinity();
    return true;
  }
  return ReadNumber(reader, kPositive, value);
}

void ReadVersion(YamlReader reader) {
  int version = 0;
  if (reader.Read(&version) && version != 1) {
    reader.Fail("version " + std::to_string(version) +
                " is not supported; this truetriad reads version 1");
  }
}

void ReadStated(YamlReader reader, const Range& range, bool may_be_unknown, Stated* stated) {
  if (!reader) return;
  if (may_be_unknown && IsWord(reader, "unknown")) {
    *stated = {};
  } else if (reader.IsMap()) {
    double number = 0.0;
    if (ReadNumber(reader.Child("value"), range, &number)) stated->value = number;
    if (ReadNumber(reader.Child("sigma"), kNotNegative, &number)) stated->sigma = number;
    reader.RejectUnknown();
  } else if (double number = 0.0; ReadNumber(reader, range, &number)) {
    *stated = {number, std::nullopt};
  }
}

}  // namespace truetriad
