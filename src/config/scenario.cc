// SPDX-License-Identifier: Apache-2.0
#include "truetriad/config/scenario.h"

#include <cstdint>
#include <optional>
#include <utility>

#include "config/documents.h"
#include "config/quantities.h"
#include "config/scenario_motion.h"
#include "config/scenario_sensor.h"
#include "config/yaml_values.h"
#include "io/yaml_reader.h"

namespace truetriad {
namespace {

/// What the documents have said so far, each read on top of those before it.
struct Draft {
  Scenario scenario;
  PerTriad<std::optional<ScenarioSensor>> sensors;
};

void ReadWorld(YamlReader reader, SimulatedWorld* world) {
  if (!reader) return;
  ReadNumber(reader.Child("gravity_mps2"), kPositive, &world->gravity_mps2);
  if (YamlReader field = reader.Child("field")) {
    ReadNumber(field.Child("strength_ut"), kPositive, &world->field_ut);
    double dip_deg = 0.0;
    if (ReadNumber(field.Child("dip_deg"), {-90.0, 90.0, "a dip of -90 to 90 degrees"}, &dip_deg)) {
      world->dip_rad = dip_deg * kRadPerDeg;
    }
    field.RejectUnknown();
  }
  if (YamlReader rate = reader.Child("earth_rate"); IsWord(rate, "none")) {
    world->earth_rate.reset();
  } else if (rate) {
    SimulatedWorld::EarthRate earth;
    double degrees = 0.0;
    if (ReadNumber(rate.RequireChild("latitude_deg"),
                   {-90.0, 90.0, "a latitude of -90 to 90 degrees"},
                   &degrees)) {
      earth.latitude_rad = degrees * kRadPerDeg;
    }
    if (ReadNumber(rate.Child("declination_deg"),
                   {-180.0, 180.0, "a declination of -180 to 180 degrees"},
                   &degrees)) {
      earth.declination_rad = degrees * kRadPerDeg;
    }
    rate.RejectUnknown();
    world->earth_rate = earth;
  }
  reader.RejectUnknown();
}

void ReadDevice(YamlReader reader, Scenario* scenario) {
  if (!reader) return;
  reader.Optional("serial", &scenario->serial);
  reader.Optional("model", &scenario->model);
  reader.RejectUnknown();
}

/// Reads one document on top of what the draft holds; files are relative to `file`.
void ReadDocument(YamlReader root, const std::string& file, Draft* draft) {
  Scenario& scenario = draft->scenario;
  ReadVersion(root.Child("scenario"));
  root.Optional("description", &scenario.description);
  root.Child("base");  // Has been read before all others.
  ReadDevice(root.Child("device"), &scenario);
  if (YamlReader seed = root.Child("seed")) {
    std::int64_t value = 0;
    if (seed.Read(&value)) {
      if (value < 0) seed.Fail("a whole number of at least zero is expected");
      scenario.seed = static_cast<std::uint64_t>(value);
    }
  }
  if (YamlReader count = root.Child("count")) {
    if (count.Read(&scenario.count) && (scenario.count < 1 || scenario.count > 9999)) {
      count.Fail("1 to 9999 units are expected");
    }
  }
  ReadWorld(root.Child("world"), &scenario.world);
  if (YamlReader sensors = root.Child("sensors")) {
    for (const Triad triad : kTriads) {
      ReadScenarioSensor(sensors.Child(TriadName(triad)), triad, &draft->sensors[triad]);
    }
    sensors.RejectUnknown();
  }
  ReadMotion(root.Child("motion"), file, &scenario.motion);
  ReadNumber(root.Child("first_rest_s"), kPositive, &scenario.first_rest_s);
  ReadTemperature(root.Child("temperature"), &scenario.temperature);
  ReadDisturbances(root.Child("disturbances"), &scenario.disturbances);
  root.RejectUnknown();
}

/// Reads the scenario that the documents name as their base, if any does.
void ReadBase(const std::string& file, Draft* draft, std::vector<std::string>* errors) {
  Result<YamlReader> base = YamlReader::FromFile(file);
  if (!base) {
    errors->push_back(base.error().message);
    return;
  }
  base->RequireChild("scenario");
  if (YamlReader further = base->Child("base")) {
    further.Fail("this scenario is the base of another and must not have one itself");
  }
  ReadDocument(*base, file, draft);
  if (const Status status = base->status(); !status) errors->push_back(status.error().message);
}

/// `prefix` before each line of `message`.
void AddLines(const std::string& prefix, std::string message, std::vector<std::string>* errors) {
  for (std::size_t end = 0; !message.empty(); message.erase(0, end)) {
    end = message.find('\n');
    errors->push_back(prefix + message.substr(0, end));
    end = end == std::string::npos ? message.size() : end + 1;
  }
}

}  // namespace

Result<Scenario> ReadScenario(const std::string& path, const std::vector<std::string>& overrides) {
  Result<YamlReader> main = YamlReader::FromFile(path);
  TRUETRIAD_RETURN_IF_ERROR(main);
  main->RequireChild("scenario");
  Result<Documents> documents = Documents::Of(*main, overrides);
  TRUETRIAD_RETURN_IF_ERROR(documents);

  Draft draft;
  std::vector<std::string> errors;
  std::string base;
  for (YamlReader& document : documents->all()) document.Optional("base", &base);
  if (!base.empty()) ReadBase(Resolve(base, path), &draft, &errors);
  for (const YamlReader& document : documents->all()) ReadDocument(document, path, &draft);
  documents->CollectErrors(&errors);
  if (errors.empty()) {
    for (const Triad triad : kTriads) {
      if (!draft.sensors[triad]) continue;
      const std::string place = path + ": sensors." + std::string(TriadName(triad)) + ": ";
      draft.scenario.sensors[triad] = SettledSensor(*draft.sensors[triad], place, &errors);
    }
  }
  if (errors.empty()) {
    const Status valid = draft.scenario.Validate();
    if (!valid) AddLines(path + ": ", valid.error().message, &errors);
  }
  if (!errors.empty()) return BadInputError(Joined(errors));
  return std::move(draft.scenario);
}

}  // namespace truetriad
