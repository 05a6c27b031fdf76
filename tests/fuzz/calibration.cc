// SPDX-License-Identifier: Apache-2.0
//
// calibration.yaml: read, written back, shown, exported to every format and imported from there.
#include "fuzz/fuzz_target.h"
#include "truetriad/formats/export.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/report/report.h"

using namespace truetriad;  // NOLINT: of this source alone.

namespace {

void TryFormat(const Calibration& calibration, const FormatInfo& format) {
  ExportOptions options;
  options.software_version = "0";
  options.file_name = std::string(format.file_name);
  const Result<Export> exported = ExportCalibration(calibration, format.name, options);
  if (!exported) {
    fuzz::MustSay(exported.error());
    return;
  }
  if (!format.can_import) return;
  std::vector<std::string> paths;
  for (const ExportedFile& file : exported->files)
    paths.push_back(fuzz::WriteInput("export" + file.suffix, file.text));
  const Result<Import> imported = ImportCalibration(format.name, paths);
  if (!imported) fuzz::MustSay(imported.error());
}

}  // namespace

TRUETRIAD_FUZZ_TARGET(calibration) {
  if (input.empty()) return -1;
  const Result<Calibration> calibration =
      CalibrationFromYaml(std::string(fuzz::TextOf(input.subspan(1))), "calibration.yaml");
  if (!calibration) {
    fuzz::MustSay(calibration.error());
    return 0;
  }
  const std::string written = CalibrationToYaml(*calibration);
  const Result<Calibration> again = CalibrationFromYaml(written, "again.yaml");
  if (!again)
    fuzz::Must(false, "what was written can be read", again.error().message + "\n" + written);
  fuzz::Must(CalibrationToYaml(*again) == written,
             "calibration.yaml reads back to the same bits",
             written + CalibrationToYaml(*again));
  // One of these at a time is enough: the fuzzer varies the first byte.
  static const std::vector<FormatInfo> formats = Formats();
  const std::size_t choice = input[0] % (formats.size() + 2);
  if (choice == formats.size()) {
    CalibrationText(*calibration);
  } else if (choice == formats.size() + 1) {
    CalibrationHtml(*calibration);
  } else {
    TryFormat(*calibration, formats[choice]);
  }
  return 0;
}
