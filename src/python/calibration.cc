// SPDX-License-Identifier: Apache-2.0
#include "python/calibration.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <pybind11/eigen.h>
#include <pybind11/numpy.h>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "io/calibration_tree.h"
#include "io/reading_corrector.h"
#include "python/errors.h"
#include "python/numbers.h"
#include "report/content.h"
#include "truetriad/io/calibration_file.h"
#include "truetriad/report/report.h"

namespace truetriad::python {
namespace py = pybind11;
namespace {

/// truetriad.Sensor: one triad of a calibration.
struct HeldSensor {
  std::shared_ptr<const Calibration> of;
  Triad triad;

  const TriadCalibration& value() const { return *of->sensors[triad]; }
  bool needs_temperature() const { return value().thermal.has_value(); }
  bool needs_time() const {
    return value().thermal && (value().thermal->element_lag_s || value().thermal->rate.any());
  }
  bool needs_force() const { return value().g_sensitivity.has_value(); }
};

[[noreturn]] void RaiseUsage(const std::string& text) {
  Raise(Error(ErrorCode::kInvalidArgument, text));
}

/// An argument of correct(): a number, or one value for each reading; null if it is not given.
struct Column {
  const double* values = nullptr;
  std::size_t stride = 0;
  double operator[](std::size_t i) const { return values[stride * i]; }
};

/// An argument as an array; unset if it is None.
std::optional<Doubles> OptionalNumbers(const py::object& values, const std::string& what) {
  return values.is_none() ? std::nullopt : std::optional(NumbersOf(values, what));
}

Column ColumnOf(const std::optional<Doubles>& array, const char* name, std::size_t count) {
  if (!array) return {};
  const auto size = static_cast<std::size_t>(array->size());
  if (size != 1 && (array->ndim() != 1 || size != count)) {
    RaiseUsage(std::string(name) + " has " + std::to_string(size) + " values for " +
               std::to_string(count) + " readings; expected one number, or one for each");
  }
  return {array->data(), size == 1 ? 0U : 1U};
}

void CheckTemperature(const Doubles& temperature) {
  const double* const values = temperature.data();
  const auto infinite =
      std::find_if(values, values + temperature.size(), [](double t) { return std::isinf(t); });
  if (infinite == values + temperature.size()) return;
  Raise(Error(ErrorCode::kValueOutOfRange,
              "temperature " + std::to_string(infinite - values) +
                  " is infinite; expected degC, or NaN if it is not known"));
}

/// Checks the times along which a filter runs.
void CheckTime(const Doubles& time) {
  constexpr double kLongest = 9.2e9;  // 9.2e18 ns fit into 64 bits (2^63).
  const double* const values = time.data();
  for (py::ssize_t i = 0; i < time.size(); ++i) {
    if (!(std::abs(values[i]) < kLongest)) {
      Raise(Error(
          ErrorCode::kValueOutOfRange,
          "time " + std::to_string(i) + " is " + std::to_string(values[i]) + "; expected seconds"));
    }
    if (i > 0 && values[i] < values[i - 1]) {
      Raise(Error(
          ErrorCode::kTimeGoesBack,
          "time " + std::to_string(i) + " is before the previous one; sort the readings by time"));
    }
  }
}

bool IsListOf3(const py::array& array) {
  return (array.ndim() == 1 || array.ndim() == 2) && array.shape(array.ndim() - 1) == 3;
}

struct Correction {
  explicit Correction(ReadingCorrector of) : corrector(std::move(of)) {}

  ReadingCorrector corrector;
  const double* raw = nullptr;
  double* truth = nullptr;
  std::size_t count = 0;
  Column temperature_degc, time_s;
  const double* force_mps2 = nullptr;
  std::size_t force_stride = 0;

  void Run() {
    constexpr double kNotKnown = std::numeric_limits<double>::quiet_NaN();
    if (corrector.is_linear()) return corrector.CorrectAll(raw, count, truth);
    const Eigen::Vector3d no_force = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Map<const Eigen::Vector3d> reading(raw + 3 * i);
      Eigen::Vector3d force = no_force;
      if (force_mps2 != nullptr) {
        force = Eigen::Map<const Eigen::Vector3d>(force_mps2 + force_stride * i);
      }
      const double temperature = temperature_degc.values ? temperature_degc[i] : kNotKnown;
      const std::int64_t time_ns = time_s.values ? std::llround(1e9 * time_s[i]) : 0;
      Eigen::Map<Eigen::Vector3d>(truth + 3 * i) =
          corrector.Correct(time_ns, reading, temperature, force);
    }
  }
};

py::array OutputLike(const Doubles& readings, const std::optional<py::array>& out) {
  const std::vector<py::ssize_t> shape(readings.shape(), readings.shape() + readings.ndim());
  if (!out) return Doubles(shape);
  const bool has_shape = out->ndim() == readings.ndim() &&
                         std::equal(shape.begin(), shape.end(), out->shape()) && out->writeable();
  if (!has_shape || !py::isinstance<Doubles>(*out)) {
    RaiseUsage("out must be a writable C-contiguous float64 array of the shape of the readings");
  }
  const auto* const from = static_cast<const double*>(out->data());
  const std::less<> before;
  const bool is_apart = !before(from, readings.data() + readings.size()) ||
                        !before(readings.data(), from + readings.size());
  if (from != readings.data() && !is_apart) {
    RaiseUsage("`out` overlaps the readings; pass the readings array itself or a separate array");
  }
  return *out;
}

py::array Correct(const HeldSensor& sensor,
                  const py::object& stated_readings,
                  const py::object& stated_temperature,
                  const py::object& stated_time,
                  const py::object& stated_force,
                  const std::optional<py::array>& out) {
  const std::string name(TriadName(sensor.triad));
  const Doubles readings = NumbersOf(stated_readings, "readings");
  const auto temperature = OptionalNumbers(stated_temperature, "temperature");
  const auto time = OptionalNumbers(stated_time, "time");
  const auto specific_force = OptionalNumbers(stated_force, "specific_force");
  if (!IsListOf3(readings)) RaiseUsage(name + ": readings must have the shape (N, 3) or (3,)");
  StreamInfo stream;
  stream.triad = sensor.triad;
  stream.file = "readings";
  stream.has_temperature = temperature.has_value();
  stream.unit = ValueOf(ParseTriadUnit(sensor.triad, sensor.value().input_unit));
  Correction correction(ValueOf(ReadingCorrector::Create(sensor.value(), stream)));
  correction.count = static_cast<std::size_t>(readings.size()) / 3;
  correction.temperature_degc = ColumnOf(temperature, "temperature", correction.count);
  correction.time_s = ColumnOf(time, "time", correction.count);
  if (sensor.needs_time() && !time && correction.count > 1) {
    Raise(Error(ErrorCode::kMissingTime,
                "the calibration of the " + name +
                    " depends on the rate of temperature, or follows temperature with a lag; give "
                    "the time of each reading, s"));
  }
  if (sensor.needs_temperature() && temperature) CheckTemperature(*temperature);
  if (sensor.needs_time() && time) CheckTime(*time);
  if (sensor.needs_force()) {
    if (!specific_force) {
      Raise(Error(ErrorCode::kMissingSensor,
                  "the calibration of the " + name +
                      " has g-sensitivity; give specific_force, as the accelerometer's correct() "
                      "returns it, m/s^2"));
    }
    const auto size = static_cast<std::size_t>(specific_force->size());
    if (!IsListOf3(*specific_force) || (size != 3 && size != 3 * correction.count)) {
      RaiseUsage("specific_force must have the shape of the readings, or (3,)");
    }
    correction.force_mps2 = specific_force->data();
    correction.force_stride = size == 3 ? 0U : 3U;
  }
  py::array result = OutputLike(readings, out);
  correction.raw = readings.data();
  correction.truth = static_cast<double*>(result.mutable_data());
  WithoutGil([&] {
    correction.Run();
    return 0;
  });
  return result;
}

py::object SensorOf(const HeldCalibration& held, Triad triad) {
  if (!held.value->sensors[triad] || !held.value->IsUsable()) return py::none();
  return py::cast(HeldSensor{held.value, triad});
}

/// The first two paragraphs of the report, which state the verdict and what was calibrated.
std::string HeadOf(const Calibration& calibration) {
  const std::string text = CalibrationText(calibration);
  const std::size_t first = text.find("\n\n");
  const std::size_t second = first == std::string::npos ? first : text.find("\n\n", first + 2);
  return text.substr(0, second);
}

/// Saves the calibration; refuses to overwrite its input.
void Save(const HeldCalibration& held, const std::filesystem::path& path) {
  for (const InputFile& input : held.value->inputs) {
    std::error_code other;
    if (std::filesystem::equivalent(path, input.file, other)) {
      Raise(Error(ErrorCode::kOutputInTheWay,
                  {path.string()},
                  "is a recording that this calibration was made from; choose another name"));
    }
  }
  Check(WriteFileAtomically(path.string(), CalibrationToYaml(*held.value)));
}

void Report(const HeldCalibration& held, const std::filesystem::path& path) {
  Check(WriteFileAtomically(
      path.string(), CalibrationHtml(*held.value, {}, {.poses = held.poses.get(), .noise = {}})));
}

py::object OptionalText(const std::optional<std::string>& text) {
  return text ? py::object(Printable(*text)) : py::none();
}

/// Lets Python's copy functions return the object itself, since objects of `of` are immutable.
template <typename Class>
void BindCopies(Class& of) {
  of.def("__copy__", [](const py::object& self) { return self; });
  of.def("__deepcopy__", [](const py::object& self, const py::dict&) { return self; });
}

/// The calibration that PickleOf turned into these bytes.
HeldCalibration Unpickled(const py::bytes& yaml) {
  return HeldCalibration(ValueOf(CalibrationFromYaml(std::string(yaml), "<pickle>")));
}
py::bytes PickleOf(const Calibration& calibration) { return CalibrationToYaml(calibration); }

HeldSensor UnpickledSensor(const py::tuple& state) {
  const std::optional<Triad> triad = TriadFromName(state[1].cast<std::string>());
  const HeldCalibration of = Unpickled(state[0].cast<py::bytes>());
  if (!triad || !of.value->sensors[*triad]) RaiseUsage("the data are not a pickled Sensor");
  return {of.value, *triad};
}

void BindFinding(py::module_& module) {
  py::class_<Finding> finding(module, "Finding", "A refusal, warning or note about a run.");
  BindCopies(finding);
  finding
      .def_property_readonly(
          "code",
          [](const Finding& f) { return FindingCodeName(f.code); },
          "The code, as in docs/reasons.md: \"poorly-known\".")
      .def_property_readonly(
          "severity",
          [](const Finding& f) { return SeverityName(f.severity); },
          "The severity: \"refusal\", \"warning\" or \"note\".")
      .def_property_readonly(
          "message", [](const Finding& f) { return Printable(f.Message()); }, "Text and remedy.")
      .def_property_readonly(
          "text", [](const Finding& f) { return Printable(f.text); }, "What was found.")
      .def_property_readonly(
          "remedy", [](const Finding& f) { return Printable(f.remedy); }, "What to do.")
      .def_property_readonly(
          "sensor",
          [](const Finding& f) {
            return OptionalText(f.sensor ? std::optional<std::string>(TriadName(*f.sensor))
                                         : std::nullopt);
          },
          "The sensor that the finding is about, or None.")
      .def_property_readonly(
          "axis",
          [](const Finding& f) {
            return OptionalText(
                f.axis ? std::optional<std::string>(std::string(1, AxisLetter(*f.axis)))
                       : std::nullopt);
          },
          "\"x\", \"y\" or \"z\", or None.")
      .def_readonly("pose",
                    &Finding::pose,
                    "The number of the pose that the finding is about, from 1, or None.")
      .def_property_readonly(
          "values",
          [](const Finding& f) {
            py::dict values;
            for (const FindingValue& value : f.values) {
              py::dict one;
              one["value"] = value.value;
              one["sigma"] = py::cast(value.sigma);
              one["unit"] = value.unit;
              values[py::str(value.name)] = one;
            }
            return values;
          },
          "The finding's numbers by name: {\"value\", \"sigma\" or None, \"unit\"}.")
      .def("__repr__", [](const Finding& f) {
        return Printable("<" + std::string(SeverityName(f.severity)) + " " +
                         std::string(FindingCodeName(f.code)) + ": " + f.Message() + ">");
      });
}

void BindSensor(py::module_& module) {
  const auto stated = [](auto member) {
    return [member](const HeldSensor& s) { return s.value().*member; };
  };
  py::class_<HeldSensor> sensor(module, "Sensor", R"(One sensor of a calibration.

raw = sensitivity @ truth + bias, truth = correction @ (raw - bias); rows are sensing axes.)");
  BindCopies(sensor);
  sensor
      .def_property_readonly(
          "name",
          [](const HeldSensor& s) { return TriadName(s.triad); },
          "The sensor: \"accelerometer\", \"gyroscope\" or \"magnetometer\".")
      .def(py::pickle(
          [](const HeldSensor& s) { return py::make_tuple(PickleOf(*s.of), TriadName(s.triad)); },
          &UnpickledSensor))
      .def("__repr__",
           [](const HeldSensor& s) {
             return "<truetriad.Sensor: " + std::string(TriadName(s.triad)) + ", " +
                    s.value().input_unit + " -> " + s.value().output_unit + ">";
           })
      .def_property_readonly(
          "input_unit", stated(&TriadCalibration::input_unit), "Unit of raw readings.")
      .def_property_readonly(
          "output_unit", stated(&TriadCalibration::output_unit), "Unit of corrected readings.")
      .def_property_readonly(
          "bias", [](const HeldSensor& s) { return s.value().model.bias; }, "(3,), raw unit.")
      .def_property_readonly(
          "sensitivity",
          [](const HeldSensor& s) { return s.value().model.sensitivity; },
          "(3, 3), raw per true unit.")
      .def_property_readonly(
          "correction",
          [](const HeldSensor& s) { return s.value().model.Correction(); },
          "(3, 3), true per raw unit: the inverse of sensitivity.")
      .def_property_readonly("bias_sigma", stated(&TriadCalibration::bias_sigma), "(3,), raw unit.")
      .def_property_readonly("sensitivity_sigma",
                             stated(&TriadCalibration::sensitivity_sigma),
                             "(3, 3), raw per true unit.")
      .def_property_readonly("needs_temperature",
                             &HeldSensor::needs_temperature,
                             "Whether correct() needs temperature.")
      .def_property_readonly("needs_time", &HeldSensor::needs_time, "Whether correct() needs time.")
      .def_property_readonly("needs_specific_force",
                             &HeldSensor::needs_force,
                             "Whether correct() needs specific_force.")
      .def("correct",
           &Correct,
           py::arg("readings"),
           py::arg("temperature") = py::none(),
           py::arg("time") = py::none(),
           py::arg("specific_force") = py::none(),
           py::kw_only(),
           py::arg("out") = py::none(),
           R"(True values of raw readings, as `truetriad apply` computes them.

readings: (N, 3) or (3,), in input_unit. A C-contiguous float64 array is read where it is.
temperature: degC, one number or (N,); needed with temperature terms, clamped to their range.
time: s, (N,), not decreasing; needed if terms depend on the rate of temperature, or on a lag.
specific_force: m/s^2, (N, 3) or (3,), corrected; needed with g-sensitivity.
out: where the result goes; may be readings itself.
Returns an array of the shape of readings, in output_unit. Raises Usage for wrong shapes, BadInput if a
needed argument is missing.)");
}

}  // namespace

void BindCalibration(py::module_& module) {
  BindFinding(module);
  BindSensor(module);
  const auto sensor = [](Triad triad) {
    return [triad](const HeldCalibration& c) { return SensorOf(c, triad); };
  };
  constexpr char kSensor[] = "The Sensor; None if it was not calibrated, or is not usable.";
  py::class_<HeldCalibration> calibration(module, "Calibration", R"(What calibration.yaml holds.

A calibration that is not usable (exit code 3 of the command line) has no sensors and no covariance; its
findings say why.)");
  BindCopies(calibration);
  calibration.def_property_readonly("accelerometer", sensor(Triad::kAccelerometer), kSensor)
      .def_property_readonly("gyroscope", sensor(Triad::kGyroscope), kSensor)
      .def_property_readonly("magnetometer", sensor(Triad::kMagnetometer), kSensor)
      .def_property_readonly(
          "verdict",
          [](const HeldCalibration& c) { return VerdictName(c.value->verdict()); },
          "The verdict: \"PASS\", \"FAIL\", \"NO_RESULT\", or, if no limits are set, "
          "\"NO_LIMITS\".")
      .def_property_readonly(
          "status",
          [](const HeldCalibration& c) { return OutcomeName(c.value->outcome); },
          "The outcome: \"converged\", \"not_observable\", \"not_converged\" or \"not_enough\".")
      .def_property_readonly(
          "usable",
          [](const HeldCalibration& c) { return c.value->IsUsable(); },
          "Whether the calibration may be used; if not, the command line ends with exit code 3.")
      .def_property_readonly(
          "within_limits",
          [](const HeldCalibration& c) { return c.value->within_limits; },
          "Whether every limit is met; None if no limits are set.")
      .def_property_readonly(
          "findings",
          [](const HeldCalibration& c) { return c.value->findings; },
          "Refusals, warnings and notes, as a list of Finding.")
      .def_property_readonly(
          "serial",
          [](const HeldCalibration& c) { return Printable(c.value->serial); },
          "Serial number of the unit; empty if the log has none.")
      .def_property_readonly("_covariance",
                             [](const HeldCalibration& c) {
                               const NamedCovariance& covariance = c.value->covariance;
                               return py::make_tuple(covariance.parameters, covariance.matrix);
                             })
      .def_property_readonly(
          "_json",
          [](const HeldCalibration& c) { return NameOrText(TextOf(CalibrationTree(*c.value))); })
      .def_property_readonly(
          "text",
          [](const HeldCalibration& c) { return Printable(CalibrationText(*c.value)); },
          "The whole report as text.")
      .def(
          "to_yaml",
          [](const HeldCalibration& c) { return NameOrText(CalibrationToYaml(*c.value)); },
          "The text of calibration.yaml.")
      .def("save",
           &Save,
           py::arg("path"),
           "Writes calibration.yaml, completely or not at all. Raises BadInput if it cannot be "
           "written.")
      .def("report", &Report, py::arg("path"), "Writes the report, one HTML page.")
      .def(py::pickle([](const HeldCalibration& c) { return PickleOf(*c.value); }, &Unpickled))
      .def("__str__", [](const HeldCalibration& c) { return Printable(HeadOf(*c.value)); })
      .def("__repr__", [](const HeldCalibration& c) {
        return Printable("<truetriad.Calibration: " + HeadlineOf(*c.value).text + ">");
      });
}

}  // namespace truetriad::python
