// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "formats/convention.h"
#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/formats/export.h"
#include "truetriad/model/calibration.h"
#include "truetriad/model/gauge.h"

namespace truetriad {

// What a format can hold of one triad; shared code (restate.h) removes the rest before it is
// written, so that a writer only writes.
enum class MatrixForm {
  kNothing,  // the reading as it is
  kNone,     // the reading minus an offset
  kDiagonal,
  kSymmetric,
  kFull,
};

struct TriadCapacity {
  bool held = false;
  MatrixForm matrix = MatrixForm::kFull;
  int bias_order = 0;           // powers of the temperature in the bias
  bool matrix_thermal = false;  // powers of the temperature in the sensitivity, any order
  bool rate_thermal = false;    // bias by the rate of temperature
  bool g_sensitivity = false;
  bool axis_terms = false;  // terms.h
  // Unit of the readings that the consumer corrects; empty: that of the calibration.
  std::string_view reading_unit = {};
  // The user may choose another one with --units.
  bool free_unit = false;
  // The result has the unit of the readings (of reading_unit when they are counts), not the true
  // unit.
  bool result_in_reading_unit = false;
};

struct WriteRequest {
  const Calibration& calibration;  // what the format holds, in its units and gauge
  const ExportOptions& options;
  std::vector<std::string> comment;  // lines that every file opens with
  const Calibration* stated;         // as it was: in the units and gauge of its covariance
};

// What a file tells its consumer: of a triad that is in it its parts, or an equation of the
// format's own.
struct Carried {
  PerTriad<std::optional<CorrectionParts>> parts;
  PerTriad<Equation> equations;
  Tags device;                     // what the file says of it
  std::optional<double> field_ut;  // strength of the field that it was made with
  std::vector<std::string> notes;
};

struct ReadRequest {
  std::vector<ExportedFile> files;  // `suffix` is the name for messages
  std::optional<int> instance;
  // Which of them, before `instance`: where its parameters are, or the number that they state.
  PerTriad<std::optional<std::int64_t>> slots = {}, device_ids = {};
  std::string firmware = {};  // whose parameters they are, where that is known
};

struct Format {
  FormatInfo info;
  std::optional<Gauge> gauge = {};  // the body frame that the format needs
  // Its consumer is a vehicle's firmware, which corrects each sensor in axes of its own
  // (model/tags.h).
  bool is_firmware = false;
  PerTriad<TriadCapacity> capacity = {};
  Result<std::vector<ExportedFile>> (*write)(const WriteRequest&,
                                             std::vector<std::string>* warnings) = nullptr;
  Result<Carried> (*read)(const ReadRequest&) = nullptr;
};

std::vector<Format> AutopilotFormats();
std::vector<Format> CountsFormats();
std::vector<Format> KalibrFormats();
std::vector<Format> ListedFormats();
Format MatlabFormat();
Format JsonFormat();
Format CHeaderFormat();
Format RecordFormat();

// In the order of the documentation.
const std::vector<Format>& AllFormats();

// Error (usage): there is none of that name; says which is nearest.
Result<const Format*> FindFormat(std::string_view name);

}  // namespace truetriad
