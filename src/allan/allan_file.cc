// SPDX-License-Identifier: Apache-2.0
#include "allan/allan_file.h"

#include <string_view>
#include <vector>

#include "allan/allan_fields.h"
#include "io/yaml_fields.h"
#include "io/yaml_reader.h"
#include "io/yaml_text.h"
#include "truetriad/base/triad.h"

namespace truetriad {
namespace {

void ReadInterval(YamlReader& reader, Interval* interval) {
  reader.Require("value", &interval->value);
  reader.Require("low", &interval->low);
  reader.Require("high", &interval->high);
  if (!(interval->low >= 0.0) || interval->low > interval->value ||
      interval->value > interval->high) {
    reader.Fail("is not an interval; expected 0 <= low <= value <= high");
  }
}

/// A coefficient that may be absent. Keys of `reader` that were asked for before stay known.
void ReadCoefficient(YamlReader reader,
                     const std::string& unit,
                     std::optional<Interval>* interval) {
  if (!reader) return;
  ReadInterval(reader, &interval->emplace());
  std::string stated;
  if (reader.Require("unit", &stated) && stated != unit) {
    reader.Child("unit").Fail("is `" + stated + "`; expected `" + unit +
                              "`, as this sensor's unit is used");
  }
  reader.RejectUnknown();
}

void ReadPoint(YamlReader reader, AllanPoint* point) {
  std::vector<YamlReader> items = reader.Items();
  if (items.size() != 6) {
    reader.Fail("expected six numbers: tau, deviation, low, high, degrees of freedom, terms");
    return;
  }
  items[0].Read(&point->tau_s);
  items[1].Read(&point->deviation.value);
  items[2].Read(&point->deviation.low);
  items[3].Read(&point->deviation.high);
  items[4].Read(&point->degrees_of_freedom);
  items[5].Read(&point->terms);
}

void ReadAxis(YamlReader reader, const std::string& unit, AllanAxis* axis) {
  YamlReader density = reader.Child("noise_density");
  if (std::vector<double> range; density && density.Optional("range_s", &range)) {
    if (range.size() == 2 && range[0] <= range[1]) {
      axis->white_range_s = {range[0], range[1]};
    } else {
      density.Child("range_s").Fail("expected two numbers, the smaller first");
    }
  }
  ReadCoefficient(density, unit + "/sqrt(Hz)", &axis->white_density);
  if (YamlReader instability = reader.Child("bias_instability")) {
    BiasInstability& read = axis->instability.emplace();
    if (YamlReader minimum = instability.RequireChild("minimum")) {
      ReadInterval(minimum, &read.minimum);
      minimum.RejectUnknown();
    }
    instability.Require("tau_s", &read.tau_s);
    instability.Require("at_end", &read.at_end);
    std::optional<Interval> coefficient;
    ReadCoefficient(instability, unit, &coefficient);
    read.coefficient = *coefficient;
  }
  ReadCoefficient(reader.Child("random_walk"), unit + "/s/sqrt(Hz)", &axis->random_walk);
  ReadCoefficient(reader.Child("quantisation"), unit + "*s", &axis->quantisation);
  for (const char* const derived :
       {"noise_sigma_sample", "random_walk_sample", "quantisation_sample"}) {
    reader.Child(derived);
  }
  for (const YamlReader& point : reader.RequireChild("points").Items()) {
    ReadPoint(point, &axis->points.emplace_back());
  }
  reader.RejectUnknown();
}

void ReadTriad(YamlReader reader, AllanTriad* triad) {
  std::string unit;
  if (reader.Require("unit", &unit)) {
    if (const Result<Unit> parsed = ParseTriadUnit(triad->triad, unit)) {
      triad->unit = *parsed;
    } else {
      reader.Child("unit").Fail(parsed.error().message);
    }
  }
  double si_per_count = 0.0;
  if (reader.Optional("si_per_count", &si_per_count)) triad->si_per_count = si_per_count;
  std::string status(kAtRest);
  reader.Optional("status", &status);
  if (status == kNotAtRest) {
    if (reader.Require("disturbance", &triad->disturbance) && triad->disturbance.empty()) {
      reader.Child("disturbance").Fail("is empty; state what disturbed the unit");
    }
  } else if (status != kAtRest) {
    reader.Child("status").Fail("is `" + status + "`; expected `at_rest` or `not_at_rest`");
  }
  if (reader.Require("rate_hz", &triad->rate_hz) && !(triad->rate_hz > 0.0)) {
    reader.Child("rate_hz").Fail("must be above zero");
  }
  reader.Require("samples", &triad->samples);
  reader.Require("duration_s", &triad->duration_s);
  reader.Require("filled_samples", &triad->filled_samples);
  reader.Require("breaks", &triad->breaks);
  for (YamlReader& warning : reader.RequireChild("warnings").Items()) {
    warning.Read(&triad->warnings.emplace_back());
  }
  if (YamlReader axes = reader.RequireChild("axes")) {
    for (std::size_t axis = 0; axis < kAxisLetters.size(); ++axis) {
      if (YamlReader item = axes.RequireChild(kAxisLetters.substr(axis, 1))) {
        ReadAxis(item, unit, &triad->axes[axis]);
      }
    }
    axes.RejectUnknown();
  }
  for (const AllanAxis& axis : triad->axes) {
    if (triad->at_rest() ||
        !(axis.white_density || axis.instability || axis.random_walk || axis.quantisation)) {
      continue;
    }
    reader.Child("axes").Fail("has coefficients for a sensor that was not at rest; expected none");
  }
  reader.RejectUnknown();
}

}  // namespace

std::string AllanToYaml(const AllanResult& result) {
  YamlText out;
  out << "# Allan deviation with 95 % intervals; coefficients as in IEEE Std 952-1997, annex C. A\n"
         "# coefficient that is not observable is omitted, as are all of a sensor that is\n# "
         "not_at_rest. `..._sample`: the same noise in one\n# sample. Points: tau [s], deviation, "
         "low, high, degrees of freedom, terms averaged.\n";
  YamlFieldWriter root(out, 0);
  Fields(root, result);
  return out.str();
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
  reader.Require("source", &result.source);
  reader.Require("serial", &result.serial);
  YamlFieldReader fields(reader);
  fields("inputs", result.inputs);
  if (YamlReader sensors = reader.RequireChild("sensors")) {
    for (const Triad triad : kTriads) {
      if (YamlReader sensor = sensors.Child(TriadName(triad))) {
        result.triads.emplace_back().triad = triad;
        ReadTriad(sensor, &result.triads.back());
      }
    }
    sensors.RejectUnknown();
  }
  reader.RejectUnknown();
  TRUETRIAD_RETURN_IF_ERROR(reader.status());
  return result;
}

}  // namespace truetriad
