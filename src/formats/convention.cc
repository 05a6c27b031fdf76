// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <iterator>

#include <Eigen/LU>

#include "formats/format.h"
#include "math/dense/qr.h"

namespace truetriad {
namespace {

using Entries = Eigen::VectorXd;

Entries ByRows(const Eigen::Matrix3d& matrix) { return matrix.transpose().reshaped(); }
Eigen::Matrix3d Rows(const Entries& numbers) {
  return Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(numbers.data());
}

/// The values of the symbols that format.h uses.
struct Symbols {
  Eigen::Vector3d b;
  Eigen::Matrix3d S, C, K, G, M, R;

  explicit Symbols(const TriadCalibration& sensor)
      : b(sensor.model.bias),
        S(sensor.model.sensitivity),
        C(sensor.model.Correction()),
        K(C.diagonal().asDiagonal()),
        G(sensor.g_sensitivity.value_or(Eigen::Matrix3d::Zero())) {
    // S^T = Q U, so S = U^T Q^T; the signs make the diagonal of M positive.
    const auto [Q, U] = QrOf3(S.transpose());
    const Eigen::Vector3d signs =
        U.diagonal().unaryExpr([](double d) { return d < 0.0 ? -1.0 : 1.0; });
    M = U.transpose() * signs.asDiagonal();
    R = signs.asDiagonal() * Q.transpose();
  }
};

/// The lower triangle by columns: xx, yx, zx, yy, zy, zz.
constexpr std::array<std::array<Eigen::Index, 2>, 6> kLower = {
    {{0, 0}, {1, 0}, {2, 0}, {1, 1}, {2, 1}, {2, 2}}};

/// How a quantity is computed from our model, and how it sets CorrectionParts.
struct Convention {
  Quantity quantity;
  Entries (*of)(const Symbols& symbols);
  void (*take)(const Entries& numbers, CorrectionParts* parts);
};

void TakeMatrix(const Entries& numbers, CorrectionParts* parts) { parts->matrix = Rows(numbers); }

void TakeSensitivity(const Entries& numbers, CorrectionParts* parts) {
  parts->sensitivity = Rows(numbers) * parts->rotation.transpose();
  parts->matrix = Rows(numbers).inverse();
}

Entries LowerDeviation(const Symbols& s) {
  Entries lower(kLower.size());
  for (std::size_t i = 0; i < kLower.size(); ++i) {
    const auto& [row, col] = kLower[i];
    lower[static_cast<Eigen::Index>(i)] = s.C(row, col) - (row == col ? 1.0 : 0.0);
  }
  return lower;
}

void TakeLowerDeviation(const Entries& numbers, CorrectionParts* parts) {
  for (std::size_t i = 0; i < kLower.size(); ++i)
    parts->matrix(kLower[i][0], kLower[i][1]) += numbers[static_cast<Eigen::Index>(i)];
}

const Convention kConventions[] = {
    {Quantity::kRotationFactor,
     [](const Symbols& s) -> Entries { return ByRows(s.R); },
     [](const Entries& n, CorrectionParts* parts) { parts->rotation = Rows(n).transpose(); }},
    {Quantity::kBias,
     [](const Symbols& s) -> Entries { return s.b; },
     [](const Entries& n, CorrectionParts* parts) { parts->before = n; }},
    {Quantity::kBiasAdded,
     [](const Symbols& s) -> Entries { return -s.b; },
     [](const Entries& n, CorrectionParts* parts) { parts->before = -n; }},
    {Quantity::kBiasAfter,
     [](const Symbols& s) -> Entries { return s.C * s.b; },
     [](const Entries& n, CorrectionParts* parts) { parts->after = n; }},
    {Quantity::kCorrection, [](const Symbols& s) -> Entries { return ByRows(s.C); }, TakeMatrix},
    {Quantity::kCorrectionByColumn,
     [](const Symbols& s) -> Entries { return s.C.reshaped(); },
     [](const Entries& n, CorrectionParts* parts) { parts->matrix = Rows(n).transpose(); }},
    {Quantity::kDiagonal,
     [](const Symbols& s) -> Entries { return s.C.diagonal(); },
     [](const Entries& n, CorrectionParts* parts) { parts->matrix = n.asDiagonal(); }},
    {Quantity::kOffDiagonal,
     [](const Symbols& s) -> Entries { return Eigen::Vector3d(s.C(0, 1), s.C(0, 2), s.C(1, 2)); },
     [](const Entries& n, CorrectionParts* parts) {
       parts->matrix(0, 1) = parts->matrix(1, 0) = n[0];
       parts->matrix(0, 2) = parts->matrix(2, 0) = n[1];
       parts->matrix(1, 2) = parts->matrix(2, 1) = n[2];
     }},
    {Quantity::kMisalignment,
     [](const Symbols& s) -> Entries {
       Eigen::Matrix3d T = s.C * s.K.inverse();
       T.diagonal().setOnes();  // The entries are 1 up to rounding.
       return ByRows(T);
     },
     TakeMatrix},
    {Quantity::kGainsMatrix,
     [](const Symbols& s) -> Entries { return ByRows(s.K); },
     [](const Entries& n, CorrectionParts* parts) {
       parts->matrix = (parts->matrix * Rows(n)).eval();
     }},
    {Quantity::kGains,
     [](const Symbols& s) -> Entries { return s.C.diagonal(); },
     [](const Entries& n, CorrectionParts* parts) { parts->gains = n; }},
    {Quantity::kDeviation,
     [](const Symbols& s) -> Entries { return (s.C - Eigen::Matrix3d::Identity()).reshaped(); },
     [](const Entries& n, CorrectionParts* parts) { parts->matrix += Rows(n).transpose(); }},
    {Quantity::kLowerDeviation, LowerDeviation, TakeLowerDeviation},
    {Quantity::kSensitivity,
     [](const Symbols& s) -> Entries { return ByRows(s.S); },
     TakeSensitivity},
    {Quantity::kLowerFactor,
     [](const Symbols& s) -> Entries { return ByRows(s.M); },
     TakeSensitivity},
    {Quantity::kGSensitivity,
     [](const Symbols& s) -> Entries { return ByRows(s.G); },
     [](const Entries& n, CorrectionParts* parts) { parts->g_sensitivity = Rows(n); }},
    {Quantity::kGBehindRotation,
     [](const Symbols& s) -> Entries { return ByRows(s.G * s.R.transpose()); },
     [](const Entries& n, CorrectionParts* parts) {
       parts->g_sensitivity = Rows(n) * parts->rotation.transpose();
     }}};

template <typename Scalar>
Equation EquationIn(const CorrectionParts& parts) {
  using Vector = Eigen::Matrix<Scalar, 3, 1>;
  using Matrix = Eigen::Matrix<Scalar, 3, 3>;
  const Matrix matrix = parts.matrix.cast<Scalar>(), rotation = parts.rotation.cast<Scalar>();
  const Vector gains = parts.gains.cast<Scalar>();
  const Vector before = parts.before.cast<Scalar>(), after = parts.after.cast<Scalar>();
  const Matrix G = parts.g_sensitivity.value_or(Eigen::Matrix3d::Zero()).template cast<Scalar>();
  return [=, thermal = parts.thermal](const Eigen::Vector3d& reading,
                                      const Eigen::Vector3d& force_mps2,
                                      double temperature_degc) -> Eigen::Vector3d {
    Vector y = reading.cast<Scalar>();
    if (thermal) y -= thermal(temperature_degc).template cast<Scalar>();
    y = (y - before - G * force_mps2.cast<Scalar>()).cwiseProduct(gains).eval();
    y = (matrix * y).eval();
    const Vector result = rotation * y - after;
    return result.template cast<double>();
  };
}

const Convention& ConventionOf(Quantity quantity) {
  return *std::find_if(std::begin(kConventions), std::end(kConventions), [&](const auto& row) {
    return row.quantity == quantity;
  });
}

}  // namespace

Eigen::Index SizeOf(Quantity quantity) { return ValueOf(quantity, TriadCalibration()).size(); }

Eigen::VectorXd ValueOf(Quantity quantity, const TriadCalibration& sensor) {
  return ConventionOf(quantity).of(Symbols(sensor));
}

Stated StatedTogether(std::span<const Field> fields, const double* numbers) {
  Stated stated;
  for (const Field& field : fields) {
    const Eigen::Index size = SizeOf(field.quantity);
    stated[field.quantity] = Eigen::Map<const Eigen::VectorXd>(numbers, size);
    numbers += size;
  }
  return stated;
}

CorrectionParts CorrectionParts::Of(const Stated& stated) {
  CorrectionParts parts;
  // The enumerators are in order: a quantity that sets a matrix comes before one that changes the
  // matrix.
  for (const auto& [quantity, numbers] : stated) ConventionOf(quantity).take(numbers, &parts);
  return parts;
}

Equation EquationOf(const CorrectionParts& parts, Arithmetic arithmetic) {
  return arithmetic == Arithmetic::kFloat32 ? EquationIn<float>(parts) : EquationIn<double>(parts);
}

TriadCalibration TriadOf(const CorrectionParts& parts,
                         std::string_view reading_unit,
                         std::string_view result_unit) {
  TriadCalibration sensor;
  sensor.input_unit = reading_unit.empty() ? parts.reading_unit : reading_unit;
  sensor.output_unit = result_unit;
  sensor.model.sensitivity =
      parts.sensitivity ? *parts.sensitivity : Eigen::Matrix3d(parts.matrix.inverse());
  sensor.model.bias = parts.before + parts.thermal_constant;
  sensor.g_sensitivity = parts.g_sensitivity;
  sensor.thermal = parts.thermal_terms;
  sensor.noise.source = NoiseSource::kConfig;
  return sensor;
}

}  // namespace truetriad
