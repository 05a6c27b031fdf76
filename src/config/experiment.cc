// SPDX-License-Identifier: Apache-2.0
#include "truetriad/config/experiment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <limits>
#include <numbers>
#include <optional>
#include <set>
#include <sstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <GeographicLib/NormalGravity.hpp>

#include "io/yaml_reader.h"
#include "io/yaml_text.h"
#include "truetriad/base/named_values.h"
#include "truetriad/io/calibration_file.h"

namespace truetriad {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kRadPerDeg = std::numbers::pi / 180.0;
/// Typical anomaly of gravity against the normal gravity of the ellipsoid. formats.md §4.
constexpr double kNormalGravitySigmaMps2 = 5e-4;

/// How messages name an override.
constexpr std::string_view kOverride = "--set=";

/// The triads that this version calibrates.
constexpr std::array kCalibratedTriads = {Triad::kAccelerometer, Triad::kMagnetometer};
constexpr std::array<std::string_view, 4> kLimitQuantities = {
    "bias", "scale_error", "misalignment_rad", "residual_rms"};

/// The named values of a table that another layer owns, for messages that list them.
template <typename T, std::size_t N>
NamedValues<T, N> Named(std::string_view (*name)(T), const std::array<T, N>& values) {
  NamedValues<T, N> named;
  for (std::size_t i = 0; i < N; ++i) named.entries[i] = {values[i], name(values[i])};
  return named;
}

auto Gauges() {
  return Named(GaugeName,
               std::array{Gauge::kAccelX, Gauge::kAccelZ, Gauge::kSymmetric, Gauge::kFixture});
}
auto Models() {
  return Named(
      MatrixModelName,
      std::array{
          MatrixModel::kBias, MatrixModel::kDiagonal, MatrixModel::kSymmetric, MatrixModel::kFull});
}
auto NoiseSources() {
  return Named(NoiseSourceName, std::array{NoiseSource::kConfig, NoiseSource::kDatasheet});
}
constexpr NamedValues<AccelerometerSign, 2> kSigns = {{
    {AccelerometerSign::kSpecificForce, "specific_force"},
    {AccelerometerSign::kGravity, "gravity"},
}};
constexpr NamedValues<ExcessNoise, 2> kExcesses = {{
    {ExcessNoise::kNone, "none"},
    {ExcessNoise::kEstimate, "estimate"},
}};
constexpr NamedValues<bool, 2> kHemispheres = {{{true, "north"}, {false, "south"}}};
constexpr NamedValues<bool, 2> kLosses = {{{true, "huber"}, {false, "none"}}};
constexpr NamedValues<InitialiseMethod, 5> kMethods = {{
    {InitialiseMethod::kAuto, "auto"},
    {InitialiseMethod::kSixFaceExtremes, "six-face-extremes"},
    {InitialiseMethod::kSixPosition, "six-position"},
    {InitialiseMethod::kEllipsoidAxisAligned, "ellipsoid-axis-aligned"},
    {InitialiseMethod::kEllipsoid, "ellipsoid"},
}};

/// `number`, `{ value, sigma }` or `unknown`, as far as it has been said.
struct Stated {
  std::optional<double> value;
  std::optional<double> sigma;
};

/// What the documents have said so far. Each document (preset, experiment, override) is read on top
/// of those before it, so that a later one changes just what it names.
struct Draft {
  Experiment experiment;
  std::string input, forces_file, attitudes_file, pose_file;  ///< As written.
  Stated gravity_mps2, strength_ut, dip_deg;
  std::optional<Gauge> gauge;
  std::set<std::string> given;  ///< Full names of all keys that any document has.
};

// ---------------------------------------------------------------------------------- single values

struct Range {
  double lowest = -kInfinity;
  double highest = kInfinity;
  std::string_view expected;  ///< "a positive number".
};
constexpr Range kAnyNumber{-kInfinity, kInfinity, "a number"};
constexpr Range kPositive{
    std::numeric_limits<double>::denorm_min(), kInfinity, "a positive number"};
constexpr Range kNotNegative{0.0, kInfinity, "a number of at least zero"};

bool ReadNumber(YamlReader reader, const Range& range, double* value) {
  double number = 0.0;
  if (!reader.Read(&number)) return false;
  if (number < range.lowest || number > range.highest) {
    std::string text;
    reader.Read(&text);
    reader.Fail("`" + text + "` is out of range; " + std::string(range.expected) + " is expected");
    return false;
  }
  *value = number;
  return true;
}

template <typename T, std::size_t N>
bool ReadChoice(YamlReader reader, const NamedValues<T, N>& choices, T* value) {
  std::string word;
  if (!reader.Read(&word)) return false;
  if (const std::optional<T> choice = choices.Find(word)) {
    *value = *choice;
    return true;
  }
  std::string known;
  for (const auto& entry : choices.entries) {
    known += (known.empty() ? "" : ", ") + std::string(entry.second);
  }
  reader.Fail("`" + word + "` is not known; one of " + known + " is expected");
  return false;
}

/// True when the value is exactly this word.
bool IsWord(YamlReader reader, std::string_view word) {
  std::string text;
  return reader.IsScalar() && reader.Read(&text) && text == word;
}

/// A σ; `.inf` says that nothing is known.
bool ReadSigma(YamlReader reader, double* value) {
  if (IsWord(reader, ".inf")) {
    *value = kInfinity;
    return true;
  }
  return ReadNumber(reader, kPositive, value);
}

/// A matrix as a list of rows, or a vector as a list, each entry read by `read`; `may_be_number`:
/// one number may stand for all entries.
template <typename Matrix, typename ReadEntry>
bool ReadEntries(YamlReader reader, bool may_be_number, ReadEntry read, Matrix* matrix) {
  constexpr bool kIsVector = Matrix::ColsAtCompileTime == 1;
  if (!reader) return false;
  if (may_be_number && reader.IsScalar()) {
    double value = 0.0;
    if (!read(reader, &value)) return false;
    matrix->setConstant(value);
    return true;
  }
  std::vector<YamlReader> rows = reader.IsSequence() ? reader.Items() : std::vector<YamlReader>();
  if (rows.size() != 3) {
    reader.Fail(std::string(kIsVector ? "three numbers [x, y, z]" : "three rows [[a, b, c], …]") +
                (may_be_number ? " or one number for all" : "") + " are expected");
    return false;
  }
  Matrix result;
  for (int i = 0; i < 3; ++i) {
    YamlReader& row = rows[static_cast<std::size_t>(i)];
    if constexpr (kIsVector) {
      if (!read(row, &result(i))) return false;
    } else {
      Eigen::Vector3d entries;
      if (!ReadEntries(row, false, read, &entries)) return false;
      result.row(i) = entries.transpose();
    }
  }
  *matrix = result;
  return true;
}

template <typename Matrix>
bool ReadNumbers(const YamlReader& reader, Matrix* matrix) {
  const auto read = [](const YamlReader& entry, double* value) {
    return ReadNumber(entry, kAnyNumber, value);
  };
  return ReadEntries(reader, false, read, matrix);
}

template <typename Matrix>
bool ReadSigmas(const YamlReader& reader, Matrix* matrix) {
  return ReadEntries(reader, true, ReadSigma, matrix);
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

// --------------------------------------------------------------------------------------- sections

/// The file format has more than this version can do. Each of these goes when its feature comes.
void RefuseUnavailable(YamlReader root) {
  constexpr std::string_view kVersion = " not available in this version; ";
  YamlReader sensors = root.Child("sensors");
  if (YamlReader gyroscope = sensors.Child(TriadName(Triad::kGyroscope))) {
    gyroscope.Fail("calibrating the gyroscope is" + std::string(kVersion) +
                   "remove this sensor to calibrate the others");
  }
  for (const Triad triad : kCalibratedTriads) {
    YamlReader sensor = sensors.Child(TriadName(triad));
    if (YamlReader thermal = sensor.Child("thermal")) {
      thermal.Fail("temperature terms are" + std::string(kVersion) + "remove the key");
    }
    if (YamlReader model = sensor.Child("model"); IsWord(model, "auto")) {
      model.Fail("choosing the model automatically is" + std::string(kVersion) +
                 "name one of bias, diagonal, symmetric, full");
    }
  }
  if (YamlReader motion = root.Child("poses").Child("motion")) {
    motion.Fail("calibration without rests is" + std::string(kVersion) +
                "record rests and let them be detected");
  }
  if (YamlReader rotation = root.Child("attitudes").Child("fixture_rotation");
      IsWord(rotation, "unknown")) {
    rotation.Fail("estimating the fixture's rotation is" + std::string(kVersion) +
                  "give attitudes of the body itself and remove the key");
  }
}

void ReadDevice(YamlReader reader, Experiment* experiment) {
  if (!reader) return;
  reader.Optional("serial", &experiment->serial);
  reader.Optional("model", &experiment->model);
  reader.RejectUnknown();
}

void ReadPosition(YamlReader reader, std::optional<SitePosition>* position) {
  if (!reader) return;
  SitePosition site = position->value_or(SitePosition());
  const bool is_first = !position->has_value();
  const auto read = [&](std::string_view key, const Range& range, double* value) {
    ReadNumber(is_first ? reader.RequireChild(key) : reader.Child(key), range, value);
  };
  read("latitude_deg", {-90.0, 90.0, "a latitude of -90 to 90 degrees"}, &site.latitude_deg);
  read("height_m", {-1000.0, 20000.0, "a height in metres"}, &site.height_m);
  ReadNumber(reader.Child("longitude_deg"),
             {-180.0, 360.0, "a longitude of -180 to 360 degrees"},
             &site.longitude_deg);
  reader.Optional("date", &site.date);
  reader.RejectUnknown();
  *position = site;
}

void ReadReference(YamlReader reader, Draft* draft) {
  if (!reader) return;
  ReferenceOptions& reference = draft->experiment.options.reference;
  ReadStated(reader.Child("gravity_mps2"),
             {9.7, 9.9, "gravity at the Earth's surface in m/s^2, 9.7 to 9.9,"},
             false,
             &draft->gravity_mps2);
  ReadPosition(reader.Child("position"), &draft->experiment.position);
  if (YamlReader field = reader.Child("field")) {
    // No upper end: people normalise the field to 1 or use coils.
    ReadStated(field.Child("strength_ut"), kPositive, true, &draft->strength_ut);
    ReadStated(field.Child("dip_deg"),
               {-90.0, 90.0, "a dip of -90 to 90 degrees, positive when the field points down,"},
               true,
               &draft->dip_deg);
    ReadChoice(field.Child("hemisphere"), kHemispheres, &reference.northern_hemisphere);
    field.RejectUnknown();
  }
  ReadNumber(reader.Child("temperature_degc"),
             {-273.15, 1000.0, "a temperature in degC"},
             &reference.temperature_degc);
  reader.RejectUnknown();
}

void ReadNoise(YamlReader reader, TriadOptions* options) {
  if (!reader) return;
  if (YamlReader sigma = reader.Child("sigma"); IsWord(sigma, "auto")) {
    options->noise_sigma_raw.reset();
  } else if (Eigen::Vector3d value; ReadSigmas(sigma, &value)) {
    options->noise_sigma_raw = value;
  }
  ReadChoice(reader.Child("source"), NoiseSources(), &options->noise_source);
  if (YamlReader excess = reader.Child("excess"); excess.IsMap()) {
    if (ReadNumber(excess.RequireChild("sigma"), kNotNegative, &options->excess_sigma)) {
      options->excess = ExcessNoise::kGiven;
    }
    excess.RejectUnknown();
  } else {
    ReadChoice(excess, kExcesses, &options->excess);
  }
  reader.RejectUnknown();
}

void ReadPrior(YamlReader reader, std::optional<TriadPrior>* prior) {
  if (!reader) return;
  TriadPrior value = prior->value_or(TriadPrior());
  ReadNumbers(reader.Child("bias"), &value.bias);
  ReadSigmas(reader.Child("bias_sigma"), &value.bias_sigma);
  ReadNumbers(reader.Child("sensitivity"), &value.sensitivity);
  ReadSigmas(reader.Child("sensitivity_sigma"), &value.sensitivity_sigma);
  reader.RejectUnknown();
  *prior = value;
}

void ReadFixed(YamlReader reader, TriadOptions* options, bool* identity) {
  if (!reader) return;
  if (YamlReader matrix = reader.Child("matrix"); IsWord(matrix, "identity")) {
    *identity = true;
    options->fixed_sensitivity.reset();
  } else if (Eigen::Matrix3d value; ReadNumbers(matrix, &value)) {
    *identity = false;
    options->fixed_sensitivity = value;
  }
  Eigen::Vector3d bias;
  if (ReadNumbers(reader.Child("bias"), &bias)) options->fixed_bias = bias;
  reader.RejectUnknown();
}

void ReadSensor(YamlReader reader, Triad triad, Experiment* experiment) {
  TriadOptions& options = experiment->options.triads[triad];
  ReadChoice(reader.Child("model"), Models(), &options.model);
  if (triad == Triad::kAccelerometer) ReadChoice(reader.Child("sign"), kSigns, &options.sign);
  ReadNoise(reader.Child("noise"), &options);
  ReadPrior(reader.Child("prior"), &options.prior);
  ReadFixed(reader.Child("fixed"), &options, &experiment->fixed_identity[triad]);
  reader.RejectUnknown();
}

void ReadPoses(YamlReader reader, Draft* draft) {
  if (!reader) return;
  PosesConfig poses;
  poses.given = true;
  if (IsWord(reader, "every_row")) {
    poses.kind = PoseSelectionKind::kEveryRow;
  } else {
    int said = 0;
    if (YamlReader detect = reader.Child("detect")) {
      ++said;
      if (!IsWord(detect, "auto")) detect.Fail("`auto` is expected");
    }
    if (YamlReader every = reader.Child("every")) {
      ++said;
      poses.kind = PoseSelectionKind::kEveryN;
      if (every.Read(&poses.every) && poses.every < 1) every.Fail("at least 1 row is expected");
    }
    if (reader.Optional("column", &poses.column)) {
      ++said;
      poses.kind = PoseSelectionKind::kColumn;
    }
    if (reader.Optional("file", &draft->pose_file)) {
      ++said;
      poses.kind = PoseSelectionKind::kRanges;
    }
    reader.RejectUnknown();
    if (reader.IsMap() && said != 1) {
      reader.Fail("one of detect, every, column, file is expected, or every_row");
    }
  }
  draft->experiment.poses = poses;
}

void ReadAttitudes(YamlReader reader, Draft* draft) {
  if (!reader) return;
  AttitudeOptions& attitudes = draft->experiment.options.attitudes;
  if (IsWord(reader, "none")) {
    attitudes.kind = AttitudeKind::kNone;
    return;
  }
  YamlReader six_face = reader.Child("six_face");
  YamlReader file = reader.Child("file");
  if (six_face) {
    attitudes.kind = AttitudeKind::kSixFace;
    ReadNumber(six_face.Child("tilt_sigma_deg"), kPositive, &attitudes.tilt_sigma_deg);
    ReadNumber(six_face.Child("seat_sigma_deg"), kNotNegative, &attitudes.seat_sigma_deg);
    six_face.RejectUnknown();
  }
  if (file.Read(&draft->attitudes_file)) attitudes.kind = AttitudeKind::kGiven;
  if (attitudes.kind == AttitudeKind::kGiven) {
    ReadNumber(reader.Child("sigma_deg"), kPositive, &draft->experiment.attitudes_sigma_deg);
    YamlReader rotation = reader.Child("fixture_rotation");
    if (rotation && !IsWord(rotation, "identity")) rotation.Fail("`identity` is expected");
  }
  reader.RejectUnknown();
  if (reader.IsMap() && attitudes.kind == AttitudeKind::kNone) {
    reader.Fail("one of six_face, file is expected, or none");
  }
  if (six_face && file) reader.Fail("six_face and file exclude each other; keep one");
}

void ReadRobust(YamlReader reader, RobustOptions* robust) {
  if (!reader) return;
  if (reader.IsScalar()) {
    ReadChoice(reader, kLosses, &robust->enabled);
    return;
  }
  ReadChoice(reader.Child("loss"), kLosses, &robust->enabled);
  ReadNumber(reader.Child("scale"), kPositive, &robust->scale);
  reader.RejectUnknown();
}

void ReadInitialise(YamlReader reader, Draft* draft) {
  if (!reader) return;
  InitialiseOptions& initialise = draft->experiment.options.initialise;
  ReadChoice(reader.Child("method"), kMethods, &initialise.method);
  reader.Optional("only", &initialise.only);
  reader.Optional("forces", &draft->forces_file);
  reader.RejectUnknown();
}

void ReadLimits(YamlReader reader, LimitOptions* options) {
  if (!reader) return;
  for (const Triad triad : kCalibratedTriads) {
    // `accelerometer.bias: 0.5` or, as overrides are spelled, `accelerometer: { bias: 0.5 }`.
    YamlReader sensor = reader.Child(TriadName(triad));
    for (const std::string_view quantity : kLimitQuantities) {
      const std::string name = std::string(TriadName(triad)) + "." + std::string(quantity);
      double limit = 0.0;
      for (const YamlReader& value : {reader.Child(name), sensor.Child(quantity)}) {
        if (ReadNumber(value, kNotNegative, &limit)) options->limits[name] = limit;
      }
    }
    sensor.RejectUnknown();
  }
  if (YamlReader decision = reader.Child("decision"); IsWord(decision, "simple")) {
    options->guard_band_k = 0.0;
  } else if (decision) {
    ReadNumber(decision.RequireChild("guard_band_k"), kNotNegative, &options->guard_band_k);
    decision.RejectUnknown();
  }
  reader.RejectUnknown();
}

void ReadCrossValidation(YamlReader reader, int* folds) {
  if (!reader) return;
  if (YamlReader child = reader.Child("folds"); child.Read(folds) && (*folds < 0 || *folds == 1)) {
    child.Fail("0 (none) or at least 2 folds are expected");
  }
  reader.RejectUnknown();
}

void ReadVersion(YamlReader reader) {
  int version = 0;
  if (reader.Read(&version) && version != 1) {
    reader.Fail("`" + std::to_string(version) + "` cannot be read by this version, which reads 1");
  }
}

/// Reads one document on top of what the draft holds.
void ReadDocument(YamlReader root, Draft* draft) {
  CalibrateOptions& options = draft->experiment.options;
  ReadVersion(root.Child("experiment"));
  root.Optional("input", &draft->input);
  ReadDevice(root.Child("device"), &draft->experiment);
  ReadReference(root.Child("reference"), draft);
  if (Gauge gauge; ReadChoice(root.Child("gauge"), Gauges(), &gauge)) draft->gauge = gauge;
  if (YamlReader sensors = root.Child("sensors")) {
    for (const Triad triad : kCalibratedTriads) {
      if (YamlReader sensor = sensors.Child(TriadName(triad))) {
        options.triads[triad].enabled = true;
        sensor.Child("preset");  // Has been read before all documents.
        ReadSensor(sensor, triad, &draft->experiment);
      }
    }
    sensors.RejectUnknown();
  }
  ReadPoses(root.Child("poses"), draft);
  ReadAttitudes(root.Child("attitudes"), draft);
  ReadRobust(root.Child("robust"), &options.robust);
  ReadInitialise(root.Child("initialise"), draft);
  ReadLimits(root.Child("limits"), &options.limits);
  ReadCrossValidation(root.Child("cross_validation"), &options.cross_validation_folds);
  ReadNumber(root.Child("observable_sigma"),
             {std::numeric_limits<double>::denorm_min(),
              std::nextafter(1.0, 0.0),
              "a share between 0 and 1"},
             &options.observable_sigma);
  root.RejectUnknown();
}

// ----------------------------------------------------------------------------- draft to experiment

/// `path` as seen from the folder of `experiment_path`.
std::string Resolve(const std::string& path, const std::string& experiment_path) {
  if (path.empty()) return path;
  return (std::filesystem::path(experiment_path).parent_path() / path).string();
}

Knowledge KnowledgeOf(const Stated& stated, double unit = 1.0) {
  if (!stated.value) return {};
  return {*stated.value * unit, stated.sigma.value_or(0.0) * unit};
}

void SettleGravity(Draft* draft) {
  Stated& gravity = draft->gravity_mps2;
  if (!gravity.value && draft->experiment.position) {
    const SitePosition& position = *draft->experiment.position;
    double y = 0.0;
    double z = 0.0;
    // The return value is the potential, not gravity.
    GeographicLib::NormalGravity::WGS84().Gravity(position.latitude_deg, position.height_m, y, z);
    draft->given.insert("reference.gravity_mps2");
    gravity = {std::hypot(y, z), gravity.sigma.value_or(kNormalGravitySigmaMps2)};
  }
  if (!gravity.value) gravity.value = kStandardGravityMps2;
  draft->experiment.options.reference.gravity_mps2 = KnowledgeOf(gravity);
}

/// Settles what depends on several keys; adds to `errors` what contradicts itself.
void Settle(Draft* draft, std::vector<std::string>* errors) {
  Experiment& experiment = draft->experiment;
  CalibrateOptions& options = experiment.options;
  const auto fail = [&](const std::string& message) {
    errors->push_back(experiment.path + ": " + message);
  };
  SettleGravity(draft);
  for (const auto& [name, stated] :
       {std::pair("strength_ut", &draft->strength_ut), std::pair("dip_deg", &draft->dip_deg)}) {
    if (stated->sigma && !stated->value) {
      fail(std::string("reference.field.") + name + ": has a sigma but no value; add `value:`");
    }
  }
  options.reference.field_ut = KnowledgeOf(draft->strength_ut);
  options.reference.dip_rad = KnowledgeOf(draft->dip_deg, kRadPerDeg);

  const bool has_attitudes = options.attitudes.kind != AttitudeKind::kNone;
  options.gauge = draft->gauge.value_or(has_attitudes ? Gauge::kFixture : Gauge::kAccelX);
  if (options.gauge == Gauge::kFixture && !has_attitudes) {
    fail("gauge: fixture needs attitudes from outside; give `attitudes:` or another gauge");
  }

  bool any_enabled = false;
  for (const Triad triad : kCalibratedTriads) {
    any_enabled |= options.triads[triad].enabled;
    const std::string prior = "sensors." + std::string(TriadName(triad)) + ".prior.";
    for (const std::string value : {"bias", "sensitivity"}) {
      if (draft->given.contains(prior + value) != draft->given.contains(prior + value + "_sigma")) {
        fail(prior + value + " and " + value + "_sigma belong together; give both or none");
      }
    }
  }
  if (!any_enabled) {
    fail("sensors: is missing; list what to calibrate, as in `sensors: { accelerometer: {} }`");
  }
  experiment.input = Resolve(draft->input, experiment.path);
  experiment.forces_file = Resolve(draft->forces_file, experiment.path);
  experiment.poses.file = Resolve(draft->pose_file, experiment.path);
  experiment.attitudes_file = options.attitudes.kind == AttitudeKind::kGiven
                                  ? Resolve(draft->attitudes_file, experiment.path)
                                  : "";
}

/// Writes nested maps, one key a line, and marks the lines that no document asked for.
class ResolvedText {
 public:
  explicit ResolvedText(const std::set<std::string>& given) : given_(given) {}

  void Open(std::string_view key) {
    Indent() << key << ":\n";
    path_ += std::string(key) + ".";
    ++depth_;
  }

  void Close() {
    path_.erase(path_.rfind('.', path_.size() - 2) + 1);
    --depth_;
  }

  /// One line; the value is all `parts` one after another.
  template <typename... Parts>
  void Line(std::string_view key, const Parts&... parts) {
    Indent() << key << ": ";
    (text_ << ... << parts);
    text_ << (given_.contains(path_ + std::string(key)) ? "\n" : "  # default\n");
  }

  void Line(std::string_view key, const Stated& stated) {
    if (!stated.value) {
      Line(key, "unknown");
    } else if (stated.sigma) {
      Line(key, "{ value: ", *stated.value, ", sigma: ", *stated.sigma, " }");
    } else {
      Line(key, *stated.value);
    }
  }

  const std::string& str() const { return text_.str(); }

 private:
  YamlText& Indent() { return text_ << std::string(2 * depth_, ' '); }

  const std::set<std::string>& given_;
  YamlText text_;
  std::string path_;  ///< "sensors.accelerometer."
  std::size_t depth_ = 0;
};

void WriteReference(ResolvedText& out, const Draft& draft) {
  const ReferenceOptions& reference = draft.experiment.options.reference;
  out.Open("reference");
  out.Line("gravity_mps2", draft.gravity_mps2);
  if (const auto& position = draft.experiment.position) {
    out.Open("position");
    out.Line("latitude_deg", position->latitude_deg);
    out.Line("longitude_deg", position->longitude_deg);
    out.Line("height_m", position->height_m);
    if (!position->date.empty()) out.Line("date", Quoted{position->date});
    out.Close();
  }
  out.Open("field");
  out.Line("strength_ut", draft.strength_ut);
  out.Line("dip_deg", draft.dip_deg);
  out.Line("hemisphere", kHemispheres.Name(reference.northern_hemisphere));
  out.Close();
  out.Line("temperature_degc", reference.temperature_degc);
  out.Close();
}

void WriteSensor(ResolvedText& out, Triad triad, const Experiment& experiment) {
  const TriadOptions& options = experiment.options.triads[triad];
  out.Open(TriadName(triad));
  out.Line("model", Models().Name(options.model));
  if (triad == Triad::kAccelerometer) out.Line("sign", kSigns.Name(options.sign));
  out.Open("noise");
  if (options.noise_sigma_raw) {
    out.Line("sigma", *options.noise_sigma_raw);
  } else {
    out.Line("sigma", "auto");
  }
  out.Line("source", NoiseSources().Name(options.noise_source));
  if (options.excess == ExcessNoise::kGiven) {
    out.Line("excess", "{ sigma: ", options.excess_sigma, " }");
  } else {
    out.Line("excess", kExcesses.Name(options.excess));
  }
  out.Close();
  if (const std::optional<TriadPrior>& prior = options.prior) {
    out.Open("prior");
    out.Line("bias", prior->bias);
    out.Line("bias_sigma", prior->bias_sigma);
    out.Line("sensitivity", prior->sensitivity);
    out.Line("sensitivity_sigma", prior->sensitivity_sigma);
    out.Close();
  }
  if (experiment.fixed_identity[triad] || options.fixed_sensitivity || options.fixed_bias) {
    out.Open("fixed");
    if (experiment.fixed_identity[triad]) out.Line("matrix", "identity");
    if (options.fixed_sensitivity) out.Line("matrix", *options.fixed_sensitivity);
    if (options.fixed_bias) out.Line("bias", *options.fixed_bias);
    out.Close();
  }
  out.Close();
}

void WritePoses(ResolvedText& out, const Draft& draft) {
  const PosesConfig& poses = draft.experiment.poses;
  if (!poses.given) return;  // Writing the default would overrule what a recording states.
  switch (poses.kind) {
    case PoseSelectionKind::kDetect:
      return out.Line("poses", "{ detect: auto }");
    case PoseSelectionKind::kEveryRow:
      return out.Line("poses", "every_row");
    case PoseSelectionKind::kEveryN:
      return out.Line("poses", "{ every: ", poses.every, " }");
    case PoseSelectionKind::kColumn:
      return out.Line("poses", "{ column: ", Quoted{poses.column}, " }");
    case PoseSelectionKind::kRanges:
      return out.Line("poses", "{ file: ", Quoted{draft.pose_file}, " }");
  }
}

void WriteAttitudes(ResolvedText& out, const Draft& draft) {
  const AttitudeOptions& attitudes = draft.experiment.options.attitudes;
  switch (attitudes.kind) {
    case AttitudeKind::kNone:
      return out.Line("attitudes", "none");
    case AttitudeKind::kSixFace:
      out.Open("attitudes");
      out.Open("six_face");
      out.Line("tilt_sigma_deg", attitudes.tilt_sigma_deg);
      out.Line("seat_sigma_deg", attitudes.seat_sigma_deg);
      out.Close();
      return out.Close();
    case AttitudeKind::kGiven:
      out.Open("attitudes");
      out.Line("file", Quoted{draft.attitudes_file});
      out.Line("sigma_deg", draft.experiment.attitudes_sigma_deg);
      out.Line("fixture_rotation", "identity");
      return out.Close();
  }
}

std::string ResolvedYaml(const Draft& draft) {
  const Experiment& experiment = draft.experiment;
  const CalibrateOptions& options = experiment.options;
  ResolvedText out(draft.given);
  out.Line("experiment", 1);
  if (!draft.input.empty()) out.Line("input", Quoted{draft.input});
  out.Line("device",
           "{ serial: ",
           Quoted{experiment.serial},
           ", model: ",
           Quoted{experiment.model},
           " }");
  WriteReference(out, draft);
  out.Line("gauge", Gauges().Name(options.gauge));
  out.Open("sensors");
  for (const Triad triad : kCalibratedTriads) {
    if (options.triads[triad].enabled) WriteSensor(out, triad, experiment);
  }
  out.Close();
  WritePoses(out, draft);
  WriteAttitudes(out, draft);
  out.Open("robust");
  out.Line("loss", kLosses.Name(options.robust.enabled));
  out.Line("scale", options.robust.scale);
  out.Close();
  out.Open("initialise");
  out.Line("method", kMethods.Name(options.initialise.method));
  out.Line("only", options.initialise.only);
  if (!draft.forces_file.empty()) out.Line("forces", Quoted{draft.forces_file});
  out.Close();
  out.Open("limits");
  for (const auto& [name, limit] : options.limits.limits) out.Line(name, limit);
  if (options.limits.guard_band_k > 0.0) {
    out.Line("decision", "{ guard_band_k: ", options.limits.guard_band_k, " }");
  } else {
    out.Line("decision", "simple");
  }
  out.Close();
  out.Open("cross_validation");
  out.Line("folds", options.cross_validation_folds);
  out.Close();
  out.Line("observable_sigma", options.observable_sigma);
  return out.str();
}

// -------------------------------------------------------------------------------------- documents

/// The full names of all keys below `reader`.
void CollectNames(YamlReader reader, const std::string& prefix, std::set<std::string>* names) {
  if (!reader.IsMap()) return;
  for (const std::string& key : reader.Keys()) {
    YamlReader child = reader.Child(key);
    names->insert(prefix + child.name());
    CollectNames(child, prefix, names);
  }
}

/// The experiment at `path`, or the one that made the calibration at `path`.
Result<YamlReader> OpenExperiment(const std::string& path) {
  Result<YamlReader> root = YamlReader::FromFile(path);
  if (!root || !root->Child("format")) return root;
  const Result<Calibration> calibration = ReadCalibration(path);
  TRUETRIAD_RETURN_IF_ERROR(calibration);
  return YamlReader::FromText(calibration->config_yaml, path + " (config)");
}

/// `key.sub=value` as a YAML document of its own.
Result<YamlReader> ParseOverride(const std::string& text) {
  const std::string name = std::string(kOverride) + text;
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || text.find_first_of("\n\r") != std::string::npos) {
    return UsageError(name + ": one line of the form key.sub=value is expected");
  }
  std::string yaml;
  std::string indent;
  std::string rest = text.substr(0, equals);
  while (!rest.empty()) {
    const std::size_t dot = rest.find('.');
    yaml += (indent.empty() ? "" : "\n") + indent + rest.substr(0, dot) + ":";
    indent += "  ";
    rest = dot == std::string::npos ? "" : rest.substr(dot + 1);
  }
  yaml += " " + text.substr(equals + 1);
  return YamlReader::FromText(yaml, name);
}

/// Reads the presets that the documents name, the last word of each sensor.
void ReadPresets(std::vector<YamlReader>& documents,
                 Draft* draft,
                 std::vector<std::string>* errors) {
  for (const Triad triad : kCalibratedTriads) {
    const std::string_view name = TriadName(triad);
    std::string file;
    for (YamlReader& document : documents) {
      document.Child("sensors").Child(name).Optional("preset", &file);
    }
    if (file.empty()) continue;
    Result<YamlReader> preset = YamlReader::FromFile(Resolve(file, draft->experiment.path));
    if (!preset) {
      errors->push_back(preset.error().message);
      continue;
    }
    ReadVersion(preset->RequireChild("sensor_preset"));
    preset->Child("description");
    for (const Triad other : kCalibratedTriads) preset->Child(TriadName(other));
    preset->RejectUnknown();
    if (YamlReader sensor = preset->RequireChild(name)) {
      ReadSensor(sensor, triad, &draft->experiment);
      CollectNames(sensor, "sensors.", &draft->given);
    }
    if (const Status status = preset->status(); !status) errors->push_back(status.error().message);
  }
}

std::string Joined(const std::vector<std::string>& errors) {
  std::string text;
  for (const std::string& error : errors) text += (text.empty() ? "" : "\n") + error;
  return text;
}

/// Adds the errors of a document, without those about keys whose value an override replaces. An
/// override itself has no lines to name.
void CollectErrors(const YamlReader& document,
                   const std::vector<std::string>& overridden,
                   std::vector<std::string>* errors) {
  const Status status = document.status();
  if (status) return;
  const std::string& file = document.file();
  std::istringstream lines(status.error().message);
  for (std::string error; std::getline(lines, error);) {
    // "file:line: key.sub: message"
    const std::size_t key = error.starts_with(file) ? error.find(": ", file.size()) : 0;
    const std::string about = error.substr(key == 0 ? 0 : key + 2);
    const auto concerns = [&about](const std::string& name) {
      return about.starts_with(name + ":") || about.starts_with(name + ".");
    };
    if (std::any_of(overridden.begin(), overridden.end(), concerns)) continue;
    errors->push_back(file.starts_with(kOverride) ? file + ": " + about : error);
  }
}

}  // namespace

Result<Experiment> ReadExperiment(const std::string& path,
                                  const std::vector<std::string>& overrides) {
  Result<YamlReader> main = OpenExperiment(path);
  TRUETRIAD_RETURN_IF_ERROR(main);
  main->RequireChild("experiment");
  std::vector<YamlReader> documents = {*main};
  std::vector<std::string> overridden;
  for (const std::string& text : overrides) {
    Result<YamlReader> document = ParseOverride(text);
    TRUETRIAD_RETURN_IF_ERROR(document);
    documents.push_back(*document);
    overridden.push_back(text.substr(0, text.find('=')));
  }

  const auto collect_errors = [&](std::vector<std::string>* errors) {
    for (std::size_t i = 0; i < documents.size(); ++i) {
      CollectErrors(documents[i], i == 0 ? overridden : std::vector<std::string>(), errors);
    }
  };
  std::vector<std::string> errors;
  for (const YamlReader& document : documents) RefuseUnavailable(document);
  collect_errors(&errors);
  if (!errors.empty()) return BadInputError(Joined(errors));

  Draft draft;
  draft.experiment.path = path;
  ReadPresets(documents, &draft, &errors);
  for (const YamlReader& document : documents) {
    CollectNames(document, "", &draft.given);
    ReadDocument(document, &draft);
  }
  collect_errors(&errors);
  if (errors.empty()) Settle(&draft, &errors);
  if (!errors.empty()) return BadInputError(Joined(errors));
  draft.experiment.resolved_yaml = ResolvedYaml(draft);
  return std::move(draft.experiment);
}

}  // namespace truetriad
