// SPDX-License-Identifier: Apache-2.0
#include "truetriad/config/scenario.h"

#include <map>
#include <optional>
#include <sstream>
#include <utility>

#include "config/documents.h"
#include "config/fields.h"
#include "config/scenario_fields.h"
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

/// Beside a field, where it stands, for messages that begin with `word`.
void NotePlace(FieldReader& visit,
               std::string_view key,
               const std::string& word,
               ScenarioDraft* draft) {
  if (const YamlReader child = visit.Child(key)) draft->places[word] = PlaceOf(child);
}

void WorldFields(FieldReader& visit, ScenarioDraft* draft) {
  SimulatedWorld& world = draft->scenario.world;
  NotePlace(visit, "gravity_mps2", "gravity ", draft);
  visit("gravity_mps2", world.gravity_mps2, kPositive);
  visit.Map("field", [&](FieldReader& field) {
    NotePlace(field, "strength_ut", "field strength ", draft);
    field("strength_ut", world.field_ut, kPositive);
    field(InDegrees("dip_deg"), world.dip_rad, kDipDeg);
  });
  const auto earth_rate = [&](FieldReader& in) {
    SimulatedWorld::EarthRate& rate = world.earth_rate.emplace();
    in.Require("latitude_deg");
    in(InDegrees("latitude_deg"), rate.latitude_rad, kLatitudeDeg);
    in(InDegrees("declination_deg"), rate.declination_rad, kDeclinationDeg);
  };
  visit.Map(
      "earth_rate", earth_rate, {.words = {{"none", false, [&] { world.earth_rate.reset(); }}}});
}

/// One document on top of what the draft holds; files are relative to `file`.
void ScenarioFields(FieldReader& visit, const std::string& file, ScenarioDraft* draft) {
  Scenario& scenario = draft->scenario;
  int version = kVersion;
  visit("scenario", version, FormatVersion());
  visit("description", scenario.description, kAnyText);
  visit.Has("base");  // Has been read before all others.
  visit.Map("device", [&](FieldReader& device) {
    device("serial", scenario.serial, kAnyText);
    device("model", scenario.model, kAnyText);
  });
  static const std::string kSessions =
      "1 to " + std::to_string(kMostSimulatedSessions) + " sessions";
  visit("seed", scenario.seed, Seed());
  visit("count", scenario.count, Range{1, 9999, "1 to 9999 units"});
  visit("sessions", scenario.sessions, Range{1, kMostSimulatedSessions, kSessions});
  visit.Map("world", [&](FieldReader& world) { WorldFields(world, draft); });
  visit.Map("sensors", [&](FieldReader& sensors) {
    for (const Triad triad : kTriads) {
      NotePlace(sensors, TriadName(triad), std::string(TriadName(triad)), draft);
      ScenarioSensorMap(sensors, triad, &draft->sensors[triad]);
    }
  });
  NotePlace(visit, "motion", "the motion ", draft);
  NotePlaces(visit.Child("motion"), "motion step", draft);
  NotePlaces(visit.Child("disturbances"), "disturbance", draft);
  CourseFields(visit, file, &scenario);
}

void ReadDocument(YamlReader root, const std::string& file, ScenarioDraft* draft) {
  FieldReader::ReadMap(std::move(root),
                       [&](FieldReader& visit) { ScenarioFields(visit, file, draft); });
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
