// SPDX-License-Identifier: Apache-2.0
#include "truetriad/config/scenario.h"

#include <charconv>
#include <map>
#include <optional>
#include <sstream>
#include <system_error>
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
struct ScenarioDraft {
  Scenario scenario;
  PerTriad<std::optional<ScenarioSensor>> sensors;
  /// Where the sensors and the items of lists stand, "file:line: ", by the words with which
  /// Scenario::Validate() names them.
  std::map<std::string, FilePlace> places;
};

/// An override has no lines.
FilePlace PlaceOf(const YamlReader& reader) {
  const bool is_override = reader.file().starts_with("--set");
  return {reader.file(), is_override ? 0 : reader.line()};
}

void NotePlaces(YamlReader list, const std::string& word, ScenarioDraft* draft) {
  if (!list.IsSequence()) return;
  int number = 0;
  for (const YamlReader& item : list.Items()) {
    draft->places[word + " " + std::to_string(++number) + " "] = PlaceOf(item);
  }
}

void ReadWorld(YamlReader reader, ScenarioDraft* draft) {
  if (!reader) return;
  SimulatedWorld* const world = &draft->scenario.world;
  if (YamlReader gravity = reader.Child("gravity_mps2")) {
    draft->places["gravity "] = PlaceOf(gravity);
    ReadNumber(gravity, kPositive, &world->gravity_mps2);
  }
  if (YamlReader field = reader.Child("field")) {
    if (YamlReader strength = field.Child("strength_ut")) {
      draft->places["field strength "] = PlaceOf(strength);
      ReadNumber(strength, kPositive, &world->field_ut);
    }
    double dip_deg = 0.0;
    if (ReadNumber(field.Child("dip_deg"), kDipDeg, &dip_deg)) {
      world->dip_rad = dip_deg * kRadPerDeg;
    }
    field.RejectUnknown();
  }
  if (YamlReader rate = reader.Child("earth_rate"); IsWord(rate, "none")) {
    world->earth_rate.reset();
  } else if (rate) {
    SimulatedWorld::EarthRate earth;
    double degrees = 0.0;
    if (ReadNumber(rate.RequireChild("latitude_deg"), kLatitudeDeg, &degrees)) {
      earth.latitude_rad = degrees * kRadPerDeg;
    }
    if (ReadNumber(rate.Child("declination_deg"), kDeclinationDeg, &degrees)) {
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
void ReadDocument(YamlReader root, const std::string& file, ScenarioDraft* draft) {
  Scenario& scenario = draft->scenario;
  ReadVersion(root.Child("scenario"));
  root.Optional("description", &scenario.description);
  root.Child("base");  // Has been read before all others.
  ReadDevice(root.Child("device"), &scenario);
  std::string text;
  if (YamlReader seed = root.Child("seed"); seed.Read(&text)) {
    const char* const end = text.data() + text.size();
    const auto [parsed_to, failure] = std::from_chars(text.data(), end, scenario.seed);
    if (failure != std::errc() || parsed_to != end) {
      seed.Fail("`" + text +
                "` is not a seed; expected a whole number from 0 to 18446744073709551615");
    }
  }
  if (YamlReader count = root.Child("count")) {
    if (count.Read(&scenario.count) && (scenario.count < 1 || scenario.count > 9999)) {
      count.Fail("expected 1 to 9999 units");
    }
  }
  if (YamlReader sessions = root.Child("sessions"); sessions.Read(&scenario.sessions)) {
    if (scenario.sessions < 1 || scenario.sessions > kMostSimulatedSessions) {
      sessions.Fail("expected 1 to " + std::to_string(kMostSimulatedSessions) + " sessions");
    }
  }
  ReadWorld(root.Child("world"), draft);
  if (YamlReader sensors = root.Child("sensors")) {
    for (const Triad triad : kTriads) {
      const YamlReader sensor = sensors.Child(TriadName(triad));
      if (sensor) draft->places[std::string(TriadName(triad))] = PlaceOf(sensor);
      ReadScenarioSensor(sensor, triad, &draft->sensors[triad]);
    }
    sensors.RejectUnknown();
  }
  NotePlaces(root.Child("motion"), "motion step", draft);
  ReadMotion(root.Child("motion"), file, &scenario.motion);
  ReadNumber(root.Child("first_rest_s"), kPositive, &scenario.first_rest_s);
  if (YamlReader motion = root.Child("motion")) draft->places["the motion "] = PlaceOf(motion);
  ReadTemperature(root.Child("temperature"), &scenario.temperature);
  NotePlaces(root.Child("disturbances"), "disturbance", draft);
  ReadDisturbances(root.Child("disturbances"), &scenario.disturbances);
  root.RejectUnknown();
}

/// Reads the scenario that the documents name as their base, if any does.
void ReadBase(const std::string& file, ScenarioDraft* draft, std::vector<Error>* errors) {
  Result<YamlReader> base = YamlReader::FromFile(file);
  if (!base) {
    errors->push_back(base.error());
    return;
  }
  base->RequireChild("scenario");
  if (YamlReader further = base->Child("base")) {
    further.Fail("this scenario is the base of another, so it cannot have a base itself");
  }
  ReadDocument(*base, file, draft);
  errors->insert(errors->end(), base->errors().begin(), base->errors().end());
}

/// Each line of `message` after the place of what it is about, or else `path`.
void AddLines(const std::string& message,
              const std::string& path,
              const ScenarioDraft& draft,
              std::vector<Error>* errors) {
  std::istringstream lines(message);
  for (std::string line; std::getline(lines, line);) {
    FilePlace place{path};
    for (const auto& [word, where] : draft.places) {
      if (line.starts_with(word)) place = where;
    }
    errors->push_back(Error(ErrorCode::kInvalidValue, place, line));
  }
}

Result<Scenario> ReadOpenedScenario(YamlReader main,
                                    const std::string& path,
                                    const std::vector<std::string>& overrides) {
  main.RequireChild("scenario");
  TRUETRIAD_ASSIGN_OR_RETURN(Documents documents, Documents::Of(main, overrides));

  ScenarioDraft draft;
  std::vector<Error> errors;
  std::string base;
  for (YamlReader& document : documents.all()) document.Optional("base", &base);
  if (!base.empty()) ReadBase(Resolve(base, path), &draft, &errors);
  for (const YamlReader& document : documents.all()) ReadDocument(document, path, &draft);
  documents.CollectErrors(&errors);
  if (errors.empty()) {
    for (const Triad triad : kTriads) {
      if (!draft.sensors[triad]) continue;
      const std::string name(TriadName(triad));
      const auto fail = [&, place = draft.places[name]](const std::string& problem) {
        errors.push_back(
            Error(ErrorCode::kInvalidValue, place, "sensors." + name + ": " + problem));
      };
      draft.scenario.sensors[triad] = SettledSensor(*draft.sensors[triad], fail);
    }
  }
  if (errors.empty()) {
    const Status valid = draft.scenario.Validate();
    if (!valid) AddLines(valid.error().message, path, draft, &errors);
  }
  if (!errors.empty()) return Joined(errors);
  return std::move(draft.scenario);
}

}  // namespace

Result<Scenario> ReadScenario(const std::string& path, const std::vector<std::string>& overrides) {
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader main, YamlReader::FromFile(path));
  return ReadOpenedScenario(std::move(main), path, overrides);
}

Result<Scenario> ReadScenarioText(const std::string& text,
                                  const std::string& path,
                                  const std::vector<std::string>& overrides) {
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader main, YamlReader::FromText(text, path));
  return ReadOpenedScenario(std::move(main), path, overrides);
}

}  // namespace truetriad
