// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_file.h"

#include "allan/allan_fields.h"
#include "io/yaml_fields.h"
#include "io/yaml_reader.h"

namespace truetriad {

std::string AllanToYaml(const AllanResult& result) {
  YamlFieldWriter root;
  Fields(root, result);
  return "# Allan deviation with 95 % intervals; coefficients as in IEEE Std 952-1997, annex C. A\n"
         "# coefficient that is not observable is omitted; a sensor that is not_at_rest has none.\n"
         "# `..._sample`: the same noise in steps of one sample. Points: tau [s], deviation, low,\n"
         "# high, degrees of freedom, number of terms averaged.\n" +
         root.text();
}

Result<AllanResult> ReadAllanFile(const std::string& path) {
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader reader, YamlReader::FromFile(path));
  AllanResult result;
  std::string format;
  reader.Require("format", &format);
  TRUETRIAD_RETURN_IF_ERROR(reader.status());
  if (format != kAllanFormat) {
    reader.Child("format").Fail("is `" + format + "`; expected `" + std::string(kAllanFormat) +
                                "`, as written by `truetriad allan`");
    return reader.status().error();
  }
  NumbersFieldReader<Numbers::kFinite> root(reader);
  Fields(root, result);
  reader.RejectUnknown();
  TRUETRIAD_RETURN_IF_ERROR(reader.status());
  return result;
}

}  // namespace truetriad
