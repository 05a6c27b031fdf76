// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Core>

#include "truetriad/base/result.h"
#include "truetriad/base/triad.h"
#include "truetriad/formats/export.h"
#include "truetriad/model/calibration.h"
#include "truetriad/model/gauge.h"

namespace truetriad {

// A field of a file states one quantity of our model, result = C (y - b - G f) with C = S^-1. The
// right column names the part of the consumer's equation (CorrectionParts) that it sets.
enum class Quantity {
  kRotationFactor,      // R by rows of S = M R, a rotation     transpose of the rotation
  kBias,                // b                                    before
  kBiasAdded,           // -b                                   before
  kBiasAfter,           // C b                                  after
  kCorrection,          // C by rows                            matrix
  kCorrectionByColumn,  // C by columns                         matrix
  kDiagonal,            // C_xx, C_yy, C_zz                     diagonal of the matrix
  kOffDiagonal,         // C_xy, C_xz, C_yz, C symmetric        the matrix beside its diagonal
  kMisalignment,        // C K^-1 by rows, K = diag(C)          matrix
  kGainsMatrix,         // K by rows                            on the right of the matrix
  kGains,               // C_xx, C_yy, C_zz                     gains
  kDeviation,           // C - I by columns                     matrix, with I
  kLowerDeviation,      // C - I, lower triangle by columns     matrix, with I
  kSensitivity,         // S by rows                            inverse of the matrix
  kLowerFactor,         // M by rows, lower triangular          inverse of the matrix
  kGSensitivity,        // G by rows                            g_sensitivity
  kGBehindRotation,     // A by rows of G = A R                 g_sensitivity, with R
};

// A field of a triad: its name or position in the file, in the syntax of the file.
struct Field {
  std::string_view name;
  Quantity quantity;
  bool is_optional = false;
};

// The number of entries of the quantity.
Eigen::Index SizeOf(Quantity quantity);
// The entries in the order of the file.
Eigen::VectorXd ValueOf(Quantity quantity, const TriadCalibration& sensor);

// The quantities that files state of a triad.
using Stated = std::map<Quantity, Eigen::VectorXd>;

// The quantities of `fields`, whose numbers follow each other in `numbers`.
Stated StatedTogether(std::span<const Field> fields, const double* numbers);

// The equation of a consumer:
//
//   result = rotation matrix ((y - thermal(T) - before - g_sensitivity f) o gains) - after
struct CorrectionParts {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d gains = Eigen::Vector3d::Ones();
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  Eigen::Vector3d after = Eigen::Vector3d::Zero();
  std::optional<Eigen::Matrix3d> g_sensitivity = {};
  // The thermal bias in the consumer's arithmetic.
  std::function<Eigen::Vector3d(double temperature_degc)> thermal = {};

  // For an import: S if the file states it, temperature terms with their contribution to the bias
  // at their reference, and the unit of the readings if the format does not fix it.
  std::optional<Eigen::Matrix3d> sensitivity = {};
  Eigen::Vector3d thermal_constant = Eigen::Vector3d::Zero();
  std::optional<ThermalTerms> thermal_terms = {};
  std::string reading_unit = {};

  // The matrices are not finite if the file states the inverse of a singular one.
  static CorrectionParts Of(const Stated& stated);
};

// The consumer's result for a reading, in its units and its arithmetic.
using Equation = std::function<Eigen::Vector3d(
    const Eigen::Vector3d& reading, const Eigen::Vector3d& force_mps2, double temperature_degc)>;

// Computed in float32 if that is the consumer's arithmetic, else in double.
Equation EquationOf(const CorrectionParts& parts, Arithmetic arithmetic);
// The correction as our model. `reading_unit` and `result_unit` are those of the consumer.
TriadCalibration TriadOf(const CorrectionParts& parts,
                         std::string_view reading_unit,
                         std::string_view result_unit);

// What a format can hold of one triad. Restate (restate.h) removes everything else before the
// format's writer is called.
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
  int bias_order = 0;           // highest power of the temperature in the bias
  bool matrix_thermal = false;  // powers of the temperature in the sensitivity, any order
  bool rate_thermal = false;    // bias terms in the rate of temperature
  bool g_sensitivity = false;
  bool axis_terms = false;  // terms.h
  // Unit of the readings that the consumer corrects; empty: that of the calibration.
  std::string_view reading_unit = {};
  // The user may choose another unit with --units.
  bool free_unit = false;
  // The result has the unit of the readings (reading_unit when they are counts), not the true unit.
  bool result_in_reading_unit = false;
};

struct WriteRequest {
  const Calibration& calibration;  // what the format holds, in its units and gauge
  const ExportOptions& options;
  std::vector<std::string> comment;    // the first lines of every file
  const Calibration* stated;           // the original, in the units and gauge of its covariance
  std::vector<std::string>& warnings;  // what degrades the result is added here
};
using Files = std::vector<ExportedFile>;

// What a file tells its consumer: for each triad in the file the parts of the equation, or an
// equation of the format's own.
struct Carried {
  PerTriad<std::optional<CorrectionParts>> parts;
  PerTriad<Equation> equations;
  Tags device;                     // what the file states of the device
  std::optional<double> field_ut;  // field strength during calibration
  std::vector<std::string> notes;
};

struct ReadRequest {
  std::vector<ExportedFile> files;  // `suffix` is the name that messages use
  std::optional<int> instance;
  // A sensor's parameter slot or device ID, which selects the sensor with priority over `instance`.
  PerTriad<std::optional<std::int64_t>> slots = {}, device_ids = {};
  std::string firmware = {};  // the firmware that uses the parameters, if known
};

struct Format {
  FormatInfo info;
  std::optional<Gauge> gauge = {};  // the body frame that the format needs
  // The consumer is a vehicle's firmware, which corrects each sensor in the sensor's own axes
  // (model/tags.h).
  bool is_firmware = false;
  PerTriad<TriadCapacity> capacity = {};
  std::function<Result<Files>(const WriteRequest&)> write = {};
  std::function<Result<Carried>(const ReadRequest&)> read = {};
};

std::vector<Format> AutopilotFormats();
std::vector<Format> CountsFormats();
std::vector<Format> KalibrFormats();
std::vector<Format> ListedFormats();
Format MatlabFormat();
Format JsonFormat();
Format CHeaderFormat();
Format RecordFormat();

// All formats in the order of the documentation.
const std::vector<Format>& AllFormats();

// Error (usage): there is no format of that name; the message suggests the nearest. `to_import`:
// searches only formats that can be imported.
Result<const Format*> FindFormat(std::string_view name, bool to_import = false);

}  // namespace truetriad
