// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <limits>
#include <numbers>

#include <zlib.h>

#include "formats/format.h"
#include "formats/restate.h"
#include "formats/text.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"

// A C99 header for firmware, float32:
//
//   truth = C(u) (raw - b(u) - G force),  u = (clamp(T, low, high) - reference) * per_degc
//
// b and C are polynomials in u; without temperature terms they are constants. The file holds the
// correction C instead of the sensitivity, so that firmware need not invert a matrix.

namespace truetriad {
namespace {

// The highest degree of the polynomial that replaces a piecewise bias (kRefitOrder of restate.cc).
constexpr int kMaxBiasOrder = 9;
// The test vectors are at both ends and in the middle of the temperature range.
constexpr int kTestVectors = 3;

/// The numbers of one triad as written in the header. Matrices by rows.
struct FloatTable {
  using Matrix = Eigen::Matrix<float, 3, 3, Eigen::RowMajor>;
  // reference, low, high degC, per_degc; only with temperature terms
  std::optional<std::array<float, 4>> temperature;
  std::vector<Eigen::Vector3f> bias;  // coefficients, by ascending powers of u
  std::vector<Matrix> correction;
  std::optional<Matrix> g_sensitivity;

  /// The correction in the order of operations of the firmware.
  Eigen::Vector3f Correct(const Eigen::Vector3f& raw,
                          const Eigen::Vector3f& force_mps2,
                          float temperature_degc) const {
    float u = 0.0F;
    if (temperature) {
      const auto& [reference, low, high, per_degc] = *temperature;
      u = (std::min(std::max(temperature_degc, low), high) - reference) * per_degc;
    }
    const auto at = [u](const auto& terms) {
      auto sum = terms.back();
      for (std::size_t k = terms.size() - 1; k-- > 0;) sum = (sum * u + terms[k]).eval();
      return sum;
    };
    Eigen::Vector3f reading = raw - at(bias);
    if (g_sensitivity) reading -= *g_sensitivity * force_mps2;
    return at(correction) * reading;
  }
};

/// The polynomials in u of the least degree that equal C(T) within a tenth of float32's rounding.
std::vector<FloatTable::Matrix> CorrectionTerms(const TriadCalibration& sensor, double per_degc) {
  const ThermalTerms& thermal = *sensor.thermal;
  const auto correction_at = [&](double u) {
    return ModelAtTemperature(sensor.model, thermal, thermal.reference_degc + u / per_degc)
        .Correction();
  };
  const double low = (thermal.range_degc[0] - thermal.reference_degc) * per_degc;
  const double high = (thermal.range_degc[1] - thermal.reference_degc) * per_degc;
  // If gains change by 0.1 % per degree, 1 / (1 + s u) needs degree four. Beyond degree eight a fit
  // does not improve further.
  constexpr int kMaxDegree = 8;
  // The error of a fit of degree eight has zeros that are closest near the ends. Between two
  // neighbouring zeros lie about two of these points near the ends, and about five in the middle.
  constexpr int kChecks = 33;
  // A tenth of the rounding error of float32.
  constexpr double kFitTolerance = 0.1 * std::numeric_limits<float>::epsilon();
  const double size = correction_at(low).norm();
  std::vector<Eigen::Matrix3d> terms;
  for (int degree = static_cast<int>(thermal.sensitivity.size()); degree <= kMaxDegree; ++degree) {
    terms.assign(static_cast<std::size_t>(degree) + 1, Eigen::Matrix3d::Zero());
    for (Eigen::Index entry = 0; entry < 9; ++entry) {
      const std::vector<double> fit = ChebyshevFit(
          [&](double u) { return correction_at(u).reshaped()[entry]; }, low, high, degree);
      for (std::size_t k = 0; k < fit.size(); ++k) terms[k].reshaped()[entry] = fit[k];
    }
    double worst = 0.0;
    for (int i = 0; i < kChecks; ++i) {
      const double u = low + (high - low) * i / (kChecks - 1.0);
      Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
      for (std::size_t k = terms.size(); k-- > 0;) sum = (sum * u + terms[k]).eval();
      worst = std::max(worst, (sum - correction_at(u)).norm() / size);
    }
    if (worst <= kFitTolerance) break;
  }
  std::vector<FloatTable::Matrix> rounded;
  for (const Eigen::Matrix3d& term : terms) rounded.emplace_back(term.cast<float>());
  return rounded;
}

FloatTable TableOf(const TriadCalibration& sensor) {
  FloatTable table;
  if (sensor.g_sensitivity) table.g_sensitivity = sensor.g_sensitivity->cast<float>();
  table.bias = {sensor.model.bias.cast<float>()};
  table.correction = {sensor.model.Correction().cast<float>()};
  if (!sensor.thermal) return table;
  const ThermalTerms& thermal = *sensor.thermal;
  const double reach = std::max(std::abs(thermal.range_degc[0] - thermal.reference_degc),
                                std::abs(thermal.range_degc[1] - thermal.reference_degc));
  // A power of two is exact in float32, so terms in u and in T - reference differ only by rounding.
  const double per_degc = std::exp2(-std::ceil(std::log2(std::max(reach, 1.0))));
  table.temperature = {static_cast<float>(thermal.reference_degc),
                       static_cast<float>(thermal.range_degc[0]),
                       static_cast<float>(thermal.range_degc[1]),
                       static_cast<float>(per_degc)};
  double power = 1.0;
  for (const Eigen::Vector3d& term : thermal.bias) {
    power /= per_degc;
    table.bias.emplace_back((power * term).cast<float>());
  }
  if (!thermal.sensitivity.empty() && thermal.range_degc[1] > thermal.range_degc[0]) {
    table.correction = CorrectionTerms(sensor, per_degc);
  }
  return table;
}

// ---------------------------------------------------------------------------------------- writing

std::string Row(const float* values, std::size_t count) {
  std::string text = "{";
  for (std::size_t i = 0; i < count; ++i) {
    text += (i == 0 ? "" : i % 5 == 0 ? ",\n     " : ", ") + FloatLiteral(values[i]);
  }
  return text + "}";
}

/// Collects declarations and the checksum of their numbers.
class HeaderText {
 public:
  void Array(const std::string& name, const float* values, std::size_t count) {
    text_ += "static const float " + name + "[" + std::to_string(count) + "] =\n    " +
             Row(values, count) + ";\n";
    Add(name, values, count);
  }

  template <typename Item>
  void Rows(const std::string& name, const Item* items, std::size_t rows) {
    const auto columns = static_cast<std::size_t>(items->size());
    text_ += "static const float " + name + "[" + std::to_string(rows) + "][" +
             std::to_string(columns) + "] = {\n";
    for (std::size_t i = 0; i < rows; ++i) {
      text_ += "    " + Row(items[i].data(), columns) + (i + 1 < rows ? ",\n" : "};\n");
    }
    Add("&" + name + "[0][0]", items->data(), rows * columns);  // Row after row.
  }

  void Plain(std::string_view text) { text_ += text; }

  const std::string& text() const { return text_; }
  const std::string& calls() const { return calls_; }
  std::uint32_t crc() const { return crc_; }

 private:
  void Add(const std::string& first, const float* values, std::size_t count) {
    calls_ += "  crc = truetriad_crc32(crc, " + first + ", " + std::to_string(count) + "u);\n";
    for (std::size_t i = 0; i < count; ++i) {
      std::uint32_t bits = 0;
      std::memcpy(&bits, &values[i], sizeof bits);
      std::array<unsigned char, 4> bytes{};
      for (unsigned j = 0; j < bytes.size(); ++j) {
        bytes[j] = static_cast<unsigned char>(bits >> (8U * j));
      }
      crc_ = static_cast<std::uint32_t>(
          ::crc32(crc_, bytes.data(), static_cast<unsigned>(bytes.size())));
    }
  }

  std::string text_;
  std::string calls_;
  std::uint32_t crc_ = 0;
};

std::string ArrayName(Triad triad, std::string_view what) {
  return "truetriad_" + std::string(TriadName(triad)) + "_" + std::string(what);
}

void WriteTables(Triad triad,
                 const TriadCalibration& sensor,
                 const FloatTable& table,
                 HeaderText* out) {
  out->Plain("\n/* " + std::string(TriadName(triad)) + ": truth [" + sensor.output_unit +
             "] from raw [" + sensor.input_unit + "]. b raw, C by rows" +
             (table.g_sensitivity ? ", G raw per m/s^2 by rows" : "") + ". */\n");
  if (table.temperature) {
    out->Plain(
        "/* reference, low, high [degC], per_degc; b_T and C_T: powers 1, 2, ... of u. */\n");
    out->Array(ArrayName(triad, "T"), table.temperature->data(), table.temperature->size());
  }
  out->Array(ArrayName(triad, "b"), table.bias[0].data(), 3);
  if (table.bias.size() > 1) {
    out->Rows(ArrayName(triad, "b_T"), &table.bias[1], table.bias.size() - 1);
  }
  out->Array(ArrayName(triad, "C"), table.correction[0].data(), 9);
  if (table.correction.size() > 1) {
    out->Rows(ArrayName(triad, "C_T"), &table.correction[1], table.correction.size() - 1);
  }
  if (table.g_sensitivity) out->Array(ArrayName(triad, "G"), table.g_sensitivity->data(), 9);
}

constexpr std::string_view kPolynomial = R"(
/* terms[0] u + terms[stride] u^2 + ... */
static inline float truetriad_polynomial(const float *terms, int count, int stride, float u) {
  float sum = 0.0f;
  int k;
  for (k = count - 1; k >= 0; --k) sum = (sum + terms[k * stride]) * u;
  return sum;
}
)";

std::string CorrectFunction(Triad triad, const FloatTable& table) {
  const bool has_force = triad == Triad::kGyroscope;
  std::string text = "\nstatic inline void " + ArrayName(triad, "correct") +
                     "(const float raw[3], " +
                     (has_force ? "const float force_mps2[3],\n    " : "") +
                     "float temperature_degc, float truth[3]) {\n";
  text += "  float reading[3];\n  int i, j;\n";
  if (table.temperature) {
    const std::string T = ArrayName(triad, "T");
    text += "  float u = temperature_degc < " + T + "[1] ? " + T + "[1] : temperature_degc;\n" +
            "  u = ((u > " + T + "[2] ? " + T + "[2] : u) - " + T + "[0]) * " + T + "[3];\n";
  }
  if (!table.temperature) text += "  (void)temperature_degc;\n";
  if (has_force && !table.g_sensitivity) text += "  (void)force_mps2;\n";
  const auto plus_terms =
      [&](std::string_view what, std::size_t terms, int stride, const std::string& index) {
        if (terms < 2) return std::string();
        return " + truetriad_polynomial(&" + ArrayName(triad, what) + "[0][" + index + "], " +
               std::to_string(terms - 1) + ", " + std::to_string(stride) + ", u)";
      };
  text += "  for (i = 0; i < 3; ++i) {\n    reading[i] = raw[i] - (" + ArrayName(triad, "b") +
          "[i]" + plus_terms("b_T", table.bias.size(), 3, "i") + ");\n";
  if (table.g_sensitivity) {
    text += "    for (j = 0; j < 3; ++j) reading[i] -= " + ArrayName(triad, "G") +
            "[3 * i + j] * force_mps2[j];\n";
  }
  text +=
      "  }\n  for (i = 0; i < 3; ++i) {\n    truth[i] = 0.0f;\n    for (j = 0; j < 3; ++j) {\n"
      "      truth[i] += (" +
      ArrayName(triad, "C") + "[3 * i + j]" +
      plus_terms("C_T", table.correction.size(), 9, "3 * i + j") +
      ") * reading[j];\n    }\n  }\n}\n";
  return text;
}

/// Raw reading, force, temperature and expected truth.
using TestVector = Eigen::Matrix<float, 10, 1>;

std::vector<TestVector> TestVectors(Triad triad, const TriadCalibration& sensor, double signal) {
  const Eigen::Vector3d directions[kTestVectors] = {
      {0.6, -0.48, 0.64}, {-0.36, 0.48, 0.8}, {0.28, 0.576, -0.768}};
  const Eigen::Vector3d force = kStandardGravityMps2 * Eigen::Vector3d(0.48, 0.64, -0.6);
  std::vector<TestVector> vectors;
  for (int i = 0; i < kTestVectors; ++i) {
    double temperature = 25.0;
    TriadModel<double> model = sensor.model;
    if (sensor.thermal) {
      const Eigen::Vector2d& range = sensor.thermal->range_degc;
      // Temperature is rounded to float32 as in firmware, so that the expected value belongs to it.
      temperature = static_cast<float>(range[0] + (range[1] - range[0]) * i / (kTestVectors - 1.0));
      model = ModelAtTemperature(sensor.model, *sensor.thermal, temperature);
    }
    const Eigen::Vector3d offset = sensor.g_sensitivity
                                       ? Eigen::Vector3d(*sensor.g_sensitivity * force)
                                       : Eigen::Vector3d::Zero();
    const Eigen::Vector3f raw = (model.RawFromTruth(signal * directions[i]) + offset).cast<float>();
    const Eigen::Vector3d truth = model.TruthFromRaw(raw.cast<double>() - offset);
    TestVector& vector = vectors.emplace_back();
    vector << raw, (triad == Triad::kGyroscope ? force : Eigen::Vector3d::Zero()).cast<float>(),
        static_cast<float>(temperature), truth.cast<float>();
  }
  return vectors;
}

/// Bound on the float32 rounding error of a test vector: each of about thirty operations rounds a
/// number no larger than the reading or the bias.
float Tolerance(const TriadCalibration& sensor, double signal) {
  constexpr double kOperations = 30.0;  // Two products with a matrix, and the polynomials.
  const double size = signal + (sensor.model.Correction() * sensor.model.bias).norm();
  return static_cast<float>(kOperations * std::numeric_limits<float>::epsilon() * size);
}

std::string SelfTest(Triad triad, float tolerance) {
  const std::string test = ArrayName(triad, "test");
  std::string text = "  for (i = 0; i < " + std::to_string(kTestVectors) + "; ++i) {\n    " +
                     ArrayName(triad, "correct") + "(&" + test + "[i][0], " +
                     (triad == Triad::kGyroscope ? "&" + test + "[i][3], " : "") + test +
                     "[i][6], truth);\n    for (j = 0; j < 3; ++j) {\n      error = truth[j] - " +
                     test + "[i][7 + j];\n      if (!(error <= " + FloatLiteral(tolerance) +
                     " && error >= -" + FloatLiteral(tolerance) + ")) return 0;\n    }\n  }\n";
  return text;
}

Result<Files> WriteCHeader(const WriteRequest& request) {
  HeaderText numbers;
  HeaderText tests;
  std::string functions;
  std::string checks;
  bool any_terms = false;
  for (const Triad triad : kTriads) {
    const std::optional<TriadCalibration>& sensor = request.calibration.sensors[triad];
    if (!sensor) continue;
    const FloatTable table = TableOf(*sensor);
    any_terms = any_terms || table.bias.size() > 1 || table.correction.size() > 1;
    WriteTables(triad, *sensor, table, &numbers);
    functions += CorrectFunction(triad, table);
    const double signal =
        triad == Triad::kAccelerometer  ? request.calibration.reference.gravity_mps2
        : triad == Triad::kMagnetometer ? request.calibration.reference.field_ut.value_or(50.0)
                                        : 1.0;
    const std::vector<TestVector> vectors = TestVectors(triad, *sensor, signal);
    tests.Rows(ArrayName(triad, "test"), vectors.data(), vectors.size());
    checks += SelfTest(triad, Tolerance(*sensor, signal));
  }
  std::string text;
  for (std::string line : request.comment) {
    for (std::size_t at = line.find("*/"); at != std::string::npos; at = line.find("*/", at)) {
      line.replace(at, 2, "* /");
    }
    text += (text.empty() ? "/* " : " * ") + line + "\n";
  }
  char crc[16];
  std::snprintf(crc, sizeof crc, "0x%08xu", static_cast<unsigned>(numbers.crc()));
  text += std::string(text.empty() ? "/*\n" : "") +
          " *\n * truth = C(u) (raw - b(u)), for the gyroscope C(u) (raw - b(u) - G force),\n"
          " * u = (clamp(temperature, low, high) - reference) * per_degc. C99 or C++.\n */\n"
          "#ifndef TRUETRIAD_CALIBRATION_H\n#define TRUETRIAD_CALIBRATION_H\n\n"
          "#include <stdint.h>\n" +
          numbers.text() +
          "\n/* CRC-32 (as of zip) of all numbers above in order, float32, low byte first. */\n"
          "#define TRUETRIAD_CALIBRATION_CRC32 " +
          crc + "\n" + (any_terms ? std::string(kPolynomial) : "") + functions +
          R"(
static inline uint32_t truetriad_crc32(uint32_t crc, const float *numbers, uint32_t count) {
  uint32_t i, j, bits = 0;
  crc = ~crc;
  for (i = 0; i < count; ++i) {
    const unsigned char *from = (const unsigned char *)&numbers[i];
    unsigned char *to = (unsigned char *)&bits;
    for (j = 0; j < 4; ++j) to[j] = from[j];
    for (j = 0; j < 32; ++j) {
      crc ^= (bits >> j) & 1u;
      crc = (crc >> 1) ^ (0xedb88320u & (0u - (crc & 1u)));
    }
  }
  return ~crc;
}

static inline uint32_t truetriad_calibration_crc32(void) {
  uint32_t crc = 0;
)" + numbers.calls() +
          "  return crc;\n}\n\n/* Each row: raw x y z, force x y z [m/s^2], temperature [degC], "
          "expected truth x y z. */\n" +
          tests.text() +
          R"(
/* Returns 1 if the CRC is right and every row above gives the expected truth. */
static inline int truetriad_self_test(void) {
  float truth[3], error;
  int i, j;
  if (truetriad_calibration_crc32() != TRUETRIAD_CALIBRATION_CRC32) return 0;
)" + checks +
          "  return 1;\n}\n\n#endif\n";
  return Files{{"", std::move(text)}};
}

// ---------------------------------------------------------------------------------------- reading

/// The numbers of an array; empty if there is none.
std::vector<float> ReadArray(const std::string& text, const std::string& name) {
  return ReadConstant(text, "static const float " + name + "[");
}

template <typename Item>
void AppendItems(const std::vector<float>& numbers, std::vector<Item>* items) {
  const auto size = static_cast<std::size_t>(Item::SizeAtCompileTime);
  for (std::size_t at = 0; at + size <= numbers.size(); at += size) {
    items->emplace_back(Eigen::Map<const Item>(&numbers[at]));
  }
}

Result<Carried> ReadCHeader(const ReadRequest& request) {
  const std::string& text = request.files[0].text;
  Carried carried;
  for (const Triad triad : kTriads) {
    FloatTable table;
    AppendItems(ReadArray(text, ArrayName(triad, "b")), &table.bias);
    if (table.bias.empty()) continue;
    AppendItems(ReadArray(text, ArrayName(triad, "b_T")), &table.bias);
    AppendItems(ReadArray(text, ArrayName(triad, "C")), &table.correction);
    AppendItems(ReadArray(text, ArrayName(triad, "C_T")), &table.correction);
    const std::vector<float> temperature = ReadArray(text, ArrayName(triad, "T"));
    if (temperature.size() == 4) {
      table.temperature = {temperature[0], temperature[1], temperature[2], temperature[3]};
    }
    std::vector<FloatTable::Matrix> g_sensitivity;
    AppendItems(ReadArray(text, ArrayName(triad, "G")), &g_sensitivity);
    if (!g_sensitivity.empty()) table.g_sensitivity = g_sensitivity[0];
    carried.equations[triad] = [table](const Eigen::Vector3d& reading,
                                       const Eigen::Vector3d& force_mps2,
                                       double temperature_degc) -> Eigen::Vector3d {
      return table
          .Correct(
              reading.cast<float>(), force_mps2.cast<float>(), static_cast<float>(temperature_degc))
          .cast<double>();
    };
  }
  return carried;
}

}  // namespace

Format CHeaderFormat() {
  constexpr TriadCapacity kHeld = {.held = true,
                                   .bias_order = kMaxBiasOrder,
                                   .matrix_thermal = true,
                                   .g_sensitivity = true,
                                   .free_unit = true};
  return {.info = {"c-header",
                   "C99 header for firmware, with CRC and test vectors",
                   "calibration.h",
                   Arithmetic::kFloat32},
          .capacity = {{kHeld, kHeld, kHeld}},
          .write = WriteCHeader,
          .read = ReadCHeader};
}

}  // namespace truetriad
