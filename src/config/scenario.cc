// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/documents.h"
#include "config/fields.h"
#include "config/scenario_fields.h"
#include "config/schemas.h"
#include "io/yaml_reader.h"
#include "truetriad/config/experiment.h"

namespace truetriad {
namespace {

/// The scenario while its documents are read. A later document replaces values of earlier ones.
struct ScenarioDraft {
  Scenario scenario;
  PerTriad<std::optional<ScenarioSensor>> sensors;
};

void WorldFields(auto& visit, SimulatedWorld& world) {
  visit("gravity_mps2", world.gravity_mps2, kPositive);
  visit.Map("field", [&](auto& field) {
    field("strength_ut", world.field_ut, kPositive);
    field(InDegrees("dip_deg"), world.dip_rad, kDipDeg);
  });
  const auto earth_rate = [&](auto& in) {
    SimulatedWorld::EarthRate& rate = world.earth_rate.emplace();
    in.Require("latitude_deg");
    in(InDegrees("latitude_deg"), rate.latitude_rad, kLatitudeDeg);
    in(InDegrees("declination_deg"), rate.declination_rad, kDeclinationDeg);
  };
  visit.Map(
      "earth_rate", earth_rate, {.words = {{"none", false, [&] { world.earth_rate.reset(); }}}});
}

/// Reads one document into the draft. File names in it are relative to the folder of `file`.
void ScenarioFields(auto& visit, const std::string& file, ScenarioDraft* draft) {
  Scenario& scenario = draft->scenario;
  int version = kVersion;
  visit("scenario", version, FormatVersion());
  visit("description", scenario.description, kAnyText);
  visit.Has("base");  // Accepts the key; the base is a document of its own.
  visit.Map("device", [&](auto& device) {
    device("serial", scenario.serial, kAnyText);
    device("model", scenario.model, kAnyText);
  });
  static const std::string kSessions =
      "1 to " + std::to_string(kMostSimulatedSessions) + " sessions";
  visit("seed", scenario.seed, Seed());
  visit("count", scenario.count, Range{1, 9999, "1 to 9999 units"});
  visit("sessions", scenario.sessions, Range{1, kMostSimulatedSessions, kSessions});
  visit.Map("world", [&](auto& world) { WorldFields(world, scenario.world); });
  visit.Map("sensors", [&](auto& sensors) {
    for (const Triad triad : kTriads) {
      ScenarioSensorMap(sensors, triad, &draft->sensors[triad]);
    }
  });
  CourseFields(visit, file, &scenario);
}

/// Opens the scenario that is the base of another scenario.
Result<YamlReader> OpenBase(const std::string& file) {
  TRUETRIAD_ASSIGN_OR_RETURN(YamlReader base, YamlReader::FromFile(file));
  base.RequireChild("scenario");
  if (YamlReader further = base.Child("base")) {
    further.Fail("this scenario is the base of another, so it cannot have a base itself");
  }
  return base;
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
  if (!base.empty()) {
    const Result<YamlReader> opened = OpenBase(Resolve(base, path));
    opened ? documents.PutBelow(*opened) : errors.push_back(opened.error());
  }
  for (const YamlReader& document : documents.all()) {
    const std::string file = IsOverride(document.file()) ? path : document.file();
    FieldReader::ReadMap(document, [&](auto& visit) { ScenarioFields(visit, file, &draft); });
  }
  documents.CollectErrors(&errors);
  const Places places = documents.AllPlaces();
  const auto fail = [&](const std::string& key, const std::string& problem) {
    const std::string place = PlaceOf(key, places);
    errors.push_back(ErrorIn(ErrorCode::kInvalidValue, place.empty() ? path : place, problem));
  };
  if (errors.empty()) {
    for (const Triad triad : kTriads) {
      if (!draft.sensors[triad]) continue;
      const std::string key = "sensors." + std::string(TriadName(triad));
      draft.scenario.sensors[triad] =
          SettledSensor(*draft.sensors[triad],
                        [&](const std::string& problem) { fail(key, key + ": " + problem); });
    }
  }
  if (errors.empty()) {
    for (const Error& mistake : draft.scenario.Mistakes()) fail(mistake.key, mistake.message);
  }
  if (!errors.empty()) return Joined(errors);
  return std::move(draft.scenario);
}

}  // namespace

Json ScenarioSchema() {
  return FieldSchema::OfFile("A scenario of truetriad", [](FieldSchema& visit) {
    ScenarioDraft draft;
    visit.Require("scenario");
    ScenarioFields(visit, "", &draft);
  });
}

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
