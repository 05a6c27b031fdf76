// SPDX-License-Identifier: Apache-2.0
#include "faults/kinds.h"

#include <array>

namespace truetriad {
namespace {

using enum FaultForm;
using enum FaultShape;

constexpr Triad kA = Triad::kAccelerometer, kM = Triad::kMagnetometer, kG = Triad::kGyroscope;
constexpr std::initializer_list<Triad> kAll = {kA, kM, kG};
constexpr std::initializer_list<Triad> kVector = {kA, kM};
constexpr std::initializer_list<Triad> kOnlyA = {kA};
constexpr std::initializer_list<Triad> kOnlyM = {kM};
constexpr std::initializer_list<Triad> kOnlyG = {kG};
constexpr std::initializer_list<Triad> kBesideM = {kA, kG};

constexpr std::string_view kAddTerm = "add the term to the sensor's `model:` and calibrate again";
constexpr std::string_view kNoTerm =
    "the sensor model has no term for this effect: use the sensor over a smaller range, or replace "
    "it";
constexpr std::string_view kWarm = "let the unit warm up, or log its temperature, and record again";
constexpr std::string_view kThermal = "estimate temperature terms (`thermal:`)";
constexpr std::string_view kSplit =
    "record again, or cut the recording there and state its parts as sessions";
constexpr std::string_view kFastened =
    "fasten the chip and magnetic parts of the board, and record again";
constexpr std::string_view kQuiet = "record again, away from iron, magnets and currents";
constexpr std::string_view kLonger =
    "let the unit settle longer before each rest, and record again";
constexpr std::string_view kSlower = "turn the unit more slowly, or set a wider bandwidth";
constexpr std::string_view kAbout = "turn the unit about the sensor itself, or more slowly";
constexpr std::string_view kRepeat = "repeat that pose, unless it is the only such pose";
constexpr std::string_view kTurns = "turn more slowly, without gaps in the log";
constexpr std::string_view kForce = "calibrate with `g_sensitivity`";
constexpr std::string_view kFull = "estimate the whole matrix of the sensor";

// An effect that has a parameter: `model:` or `g_sensitivity` can add it to the model.
constexpr FaultKind AsParameter(ParameterKind parameter,
                                std::string_view name,
                                std::initializer_list<Triad> sensors,
                                FaultForm form) {
  FaultKind kind{name, sensors, form, kAddTerm};
  kind.parameter = parameter;
  if (parameter == ParameterKind::kGSensitivity) kind.remedy = kForce;
  if (parameter == ParameterKind::kSensitivity) {
    kind.remedy = kFull;
    kind.unit = "1";
  }
  return kind;
}

constexpr std::array kKinds = {
    AsParameter(ParameterKind::kQuadratic, "quadratic term", kVector, kSquare),
    AsParameter(ParameterKind::kCubic, "cubic term", kVector, kCube),
    FaultKind{"asymmetry", kVector, kSize, kNoTerm},
    AsParameter(ParameterKind::kAsymmetry, "asymmetry", kOnlyG, kSize),
    FaultKind{"quadratic term", kOnlyG, kSquare, kNoTerm},
    AsParameter(ParameterKind::kCubic, "cubic term", kOnlyG, kCube),
    FaultKind{"gain by rate", kOnlyG, kGainByRate, kTurns},
    AsParameter(ParameterKind::kGSensitivity, "bias by specific force", kOnlyG, kByForce),
    FaultKind{"bias by specific force", kOnlyM, kByForce, kFastened},
    FaultKind{"bias by the field", kBesideM, kByField, kQuiet},
    FaultKind{"field by attitude", kOnlyM, kByAttitude, kQuiet, "uT"},
    AsParameter(
        ParameterKind::kSensitivity, "matrix entries that its `model:` leaves out", kAll, kMatrix),
    FaultKind{"bias drift", kAll, kBias, kWarm, {}, kDrift, Varies::kBias},
    FaultKind{"bias warm-up", kAll, kBias, kWarm, {}, kWarmUp, Varies::kBias},
    FaultKind{"bias with temperature", kAll, kBias, kThermal, {}, kTemperature, Varies::kBias},
    FaultKind{"bias wander", kAll, kBias, kWarm, {}, kWander, Varies::kBias},
    FaultKind{"bias step", kAll, kBias, kSplit, {}, kStep, Varies::kBias},
    FaultKind{"bias for a while", kAll, kBias, kSplit, {}, kWindow, Varies::kBias},
    FaultKind{"gain drift", kAll, kGain, kWarm, "1", kDrift, Varies::kGain},
    FaultKind{
        "matrix with temperature", kAll, kMatrix, kThermal, "1", kTemperature, Varies::kMatrix},
    FaultKind{"gain step", kAll, kGain, kSplit, "1", kStep, Varies::kGain},
    FaultKind{"slip", kVector, kTurned, kFastened, "rad", kStep, Varies::kMounting},
    FaultKind{"field drift", kOnlyM, kWorld, kQuiet, "uT", kDrift, Varies::kField},
    FaultKind{"field wander", kOnlyM, kWorld, kQuiet, "uT", kWander, Varies::kField},
    FaultKind{"field step", kOnlyM, kWorld, kQuiet, "uT", kStep, Varies::kField},
    FaultKind{"field for a while", kOnlyM, kWorld, kQuiet, "uT", kWindow, Varies::kField},
    FaultKind{"play", kVector, kPlay, kFastened},
    FaultKind{"settling", kVector, kSettling, kLonger, "1"},
    FaultKind{"low-pass", kAll, kLowPass, kSlower, "s^2", kThroughout, Varies::kNothing, true},
    FaultKind{"lever arm", kOnlyA, kLeverArm, kAbout, "m"},
    FaultKind{"turns too short", kOnlyG, kShortTurn, kTurns, "rad"},
    FaultKind{"single pose", kAll, kReading, kRepeat, {}, kOnce},
    FaultKind{"single turn", kOnlyG, kTurn, kTurns, "rad", kOnce},
};

}  // namespace

std::span<const FaultKind> FaultKinds() { return kKinds; }

}  // namespace truetriad
