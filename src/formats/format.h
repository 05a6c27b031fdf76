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

namespace truetriad {

// A field of a file states one quantity of our model, result = C (y - b - G f) with C = S^-1. The
// right column names the part of CorrectionParts, the equation of the program that reads the file,
// which the quantity sets.
enum class Quantity {
  kRotationFactor,      // R by rows, a rotation; S = M R       transpose of the rotation
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
  kLowerFactor,         // M by rows, lower triangular; S = M R inverse of the matrix
  kGSensitivity,        // G by rows                            g_sensitivity
  kGBehindRotation,     // A by rows; G = A R                   g_sensitivity, with R
};

// A field of a triad in a file: its name or position there, and the quantity that it states.
struct Field {
  std::string_view name;
  Quantity quantity;
  bool is_optional = false;
};

// The number of entries of a quantity.
Eigen::Index SizeOf(Quantity quantity);
// The entries of a quantity, in the order of the file.
Eigen::VectorXd ValueOf(Quantity quantity, const TriadCalibration& sensor);

// The quantities of one triad that a file states.
using Stated = std::map<Quantity, Eigen::VectorXd>;

// The quantities of `fields`, whose numbers stand in `numbers` one field after another.
Stated StatedTogether(std::span<const Field> fields, const double* numbers);

// The equation of a target, the program or firmware that reads the exported file:
//
//   result = rotation matrix ((y - thermal(T) - before - g_sensitivity f) o gains) - after
struct CorrectionParts {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Identity();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d gains = Eigen::Vector3d::Ones();
  Eigen::Vector3d before = Eigen::Vector3d::Zero();
  Eigen::Vector3d after = Eigen::Vector3d::Zero();
  std::optional<Eigen::Matrix3d> g_sensitivity = {};
  // The bias terms in the temperature, computed in the target's arithmetic.
  std::function<Eigen::Vector3d(double temperature_degc)> thermal = {};

  // These are set only by an import: S and the unit of the readings, if the file states them; the
  // temperature terms, and the bias that they add at their reference temperature.
  std::optional<Eigen::Matrix3d> sensitivity = {};
  Eigen::Vector3d thermal_constant = Eigen::Vector3d::Zero();
  std::optional<ThermalTerms> thermal_terms = {};
  std::string reading_unit = {};

  // If the file states a sensitivity that is singular, `matrix` is not finite.
  static CorrectionParts Of(const Stated& stated);
};

// The target's result for a reading, in the target's units and arithmetic.
using Equation = std::function<Eigen::Vector3d(
    const Eigen::Vector3d& reading, const Eigen::Vector3d& force_mps2, double temperature_degc)>;

// If `arithmetic` is float32, the equation computes in float32, otherwise in double.
Equation EquationOf(const CorrectionParts& parts, Arithmetic arithmetic);
// The correction in terms of our model. `reading_unit` and `result_unit` are the target's units; if
// `reading_unit` is empty, `parts` states the unit.
TriadCalibration TriadOf(const CorrectionParts& parts,
                         std::string_view reading_unit,
                         std::string_view result_unit);

// What a format can hold of one triad. Before the format's writer is called, Restate (restate.h)
// removes everything else.
enum class MatrixForm {
  kNothing,  // the reading is not corrected
  kNone,     // only an offset is subtracted from the reading
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
  bool axis_terms = false;  // the axis terms of terms.h
  // Unit of the readings that the target corrects; empty: the unit in the calibration.
  std::string_view reading_unit = {};
  // The user may choose another unit with --units.
  bool free_unit = false;
  // The result has the unit of the readings instead of the true unit. If the readings are counts,
  // the result has `reading_unit`, if this is set.
  bool result_in_reading_unit = false;
};

struct WriteRequest {
  const Calibration& calibration;  // what the format can hold, in the format's units and gauge
  const ExportOptions& options;
  std::vector<std::string> comment;    // the lines of the comment in every file
  const Calibration* stated;           // the original calibration, in its own units and gauge
  std::vector<std::string>& warnings;  // the writer adds what makes the exported correction worse
};
using Files = std::vector<ExportedFile>;

// What a file states. For each triad in the file, `parts` is set or, in some formats, the whole
// equation.
struct Carried {
  PerTriad<std::optional<CorrectionParts>> parts;
  PerTriad<Equation> equations;
  Tags device;                     // what the file states about the device
  std::optional<double> field_ut;  // the field strength during calibration
  std::vector<std::string> notes;
};

struct ReadRequest {
  std::vector<ExportedFile> files;  // `suffix` is the name that messages use
  std::optional<int> instance;
  // If set for a sensor, its parameter slot or device ID selects it in place of `instance`.
  PerTriad<std::optional<std::int64_t>> slots = {}, device_ids = {};
  std::string firmware = {};  // the firmware that uses the parameters, if known
};

struct Format {
  FormatInfo info;
  std::optional<Gauge> gauge = {};  // the body frame that the format needs
  // Target is a vehicle's firmware. Each sensor is corrected in the axes that model/tags.h states.
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

// Finds a format by its name. Error (usage): no format has this name; the message suggests the
// nearest one. `to_import`: searches only formats that can be imported.
Result<const Format*> FindFormat(std::string_view name, bool to_import = false);

}  // namespace truetriad
