// SPDX-License-Identifier: Apache-2.0
//
// Files of other programs, the format by the first byte (or laboratory.yaml); a 0xFF byte ends one
// and begins the next.
#include "fuzz/fuzz_target.h"
#include "truetriad/formats/export.h"
#include "truetriad/io/calibration_file.h"

using namespace truetriad;  // NOLINT: of this source alone.

namespace {

std::vector<FormatInfo> Importable() {
  std::vector<FormatInfo> formats = Formats();
  std::erase_if(formats, [](const FormatInfo& format) { return !format.can_import; });
  return formats;
}

}  // namespace

TRUETRIAD_FUZZ_TARGET(import) {
  if (input.empty()) return -1;
  static const std::vector<FormatInfo> formats = Importable();
  std::string_view text = fuzz::TextOf(input.subspan(1));
  const std::size_t choice = (input[0] & 63U) % (formats.size() + 1);
  if (choice == formats.size()) {
    const Result<Laboratory> read = ReadLaboratory(fuzz::WriteInput("laboratory.yaml", text));
    if (!read) fuzz::MustSay(read.error());
    return 0;
  }
  const FormatInfo& format = formats[choice];
  std::vector<std::string> paths;
  for (int i = 0; i < 3; ++i) {
    const std::size_t end = text.find('\xFF');
    paths.push_back(
        fuzz::WriteInput(std::to_string(i) + std::string(format.file_name), text.substr(0, end)));
    if (end == std::string_view::npos) break;
    text.remove_prefix(end + 1);
  }
  ImportOptions options;
  if ((input[0] & 64U) != 0) {
    for (auto& unit : options.units) unit = "counts";
  }
  if ((input[0] & 128U) != 0) options.instance = 1;
  const Result<Import> imported = ImportCalibration(format.name, paths, options);
  if (!imported) {
    fuzz::MustSay(imported.error());
    return 0;
  }
  const std::string written = CalibrationToYaml(imported->calibration);
  const Result<Calibration> again = CalibrationFromYaml(written, "again.yaml");
  if (!again)
    fuzz::Must(false, "what was imported can be read", again.error().message + "\n" + written);
  return 0;
}
