// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "report/table.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"
#include "truetriad/report/report.h"

namespace truetriad {

// The content and the order of a calibration report, shared by the terminal and by HTML.

struct Headline {
  Grade grade = Grade::kBad;
  std::string text;         ///< "PASS, A0001: all 6 limits are met".
  std::string explanation;  ///< One sentence.
};
/// The text states the verdict, then the serial number and the first reason.
Headline HeadlineOf(const Calibration& calibration);
/// "FAIL by R. Roe on 2026-11-25T10:00:00Z: connector bent".
std::string DecisionText(const Decision& decision);
/// The limit that is most probably missed. If any limit failed, only failed limits are considered.
/// `limits` must not be empty.
const LimitCheck& WorstLimit(const std::vector<LimitCheck>& limits);
/// "accelerometer.bias.y -0.889 of ± 0.7 m/s²".
std::string MissedText(const LimitCheck& check);

/// A title inside a section.
struct Subtitle {
  std::string text;
};
/// One point of a list.
struct Bullet {
  std::string text;
  std::string tag = {};  ///< Shown in small type behind the text: "warning, clock-offset".
};
/// A paragraph, a subtitle, a list point or a table.
using Block = std::variant<std::string, Subtitle, Bullet, Table>;

/// A part of a page. If a section has no title, it belongs to the page's head.
struct Section {
  std::string title;
  std::vector<Block> blocks;
  std::function<std::vector<Drawing>()> draw = {};  ///< Drawings after the blocks, on pages only.

  void Add(Block block) { blocks.push_back(std::move(block)); }
};
/// The report of a verb, shared by the terminal and by HTML.
struct PageContent {
  std::string title;
  Headline headline;
  std::vector<Section> sections;
};

/// The sections in reading order: limits, findings, error before and after, parameters with σ,
/// temperature, weak directions, choice of the model, held-out error, residuals, left-out terms,
/// coverage. An empty section is left out. A calibration that is not usable has no section of
/// parameters. `turns`: the drawings of spheres hold the data with which a page can turn them.
std::vector<Section> SectionsOf(const Calibration& calibration, bool turns = false);

/// The section of the limits; each value has ± `coverage_factor` σ.
Section LimitsSection(const Calibration& calibration, double coverage_factor);

/// Serial, model, software, inputs, gauge: one row each.
Table IdentityTable(const Calibration& calibration);

/// "from an Allan deviation".
std::string_view NoiseSourceWords(NoiseSource source);

/// "Accelerometer".
std::string TriadTitle(Triad triad);

/// "0.0912 deg; 0.271 deg with nominal gains …" for errors of turns.
std::string MedianAngles(double median_rad, const std::optional<double>& nominal_rad);

/// The true unit of one triad, for display.
std::string TruthUnit(Triad triad);

// The sections of a calibration's report; a section with nothing to say has no blocks.

/// Errors of readings before and after the calibration, in true units. `turns` as in SectionsOf.
Section CorrectedErrorSection(const Calibration& calibration, bool turns);

/// The bias that the poses at each temperature give by themselves, compared with the temperature
/// terms, and the errors with and without those terms.
Section SoakSection(const Calibration& calibration);

/// A temperature sweep axis by axis: terms and lags, errors before and after, terms left out, how
/// terms were chosen, the fit beside the data, and the bias over temperature and rate.
Section SweepSection(const Calibration& calibration);

/// The sections of a calibration from poses that follow the section of the parameters.
Section LeftOutSection(const Quality& quality);
Section ModelChoiceSection(const Quality& quality);
Section HeldOutSection(const Calibration& calibration);
Section ResidualsSection(const Calibration& calibration);
Section CoverageSection(const Calibration& calibration);

/// Adds a table of a sensor's bias in each session, to stand after the sensor's parameters.
void AddSessions(const RestQuality& quality,
                 Triad triad,
                 const std::string& unit,
                 Section* section);

/// Derivatives J of a quantity by parameter name, and the quantity's σ = sqrt(J P J^T). Returns
/// nullopt if the covariance lacks one of the names.
using Derivatives = std::vector<std::pair<std::string, double>>;
std::optional<double> SigmaOf(const NamedCovariance& covariance, const Derivatives& derivatives);

/// Bias, scale and scale error (the whole matrix if the axes are permuted), temperature terms and
/// noise of one triad, with σ; one column for each axis.
Table ParameterTable(const TriadCalibration& sensor,
                     Triad triad,
                     const NamedCovariance& covariance);

/// The numbers of one triad's model raw = S truth + b, each with ± `coverage_factor` σ.
Table ResultTable(const TriadCalibration& sensor,
                  Triad triad,
                  const NamedCovariance& covariance,
                  double coverage_factor);

/// The share of each body axis (columns) that a chip's axis (rows) senses, with σ, in mrad and
/// degrees. Empty if the axes are permuted.
Table MisalignmentTable(const TriadCalibration& sensor,
                        Triad triad,
                        const NamedCovariance& covariance);

/// C and b of corrected = C (raw - b), as firmware needs them: the rows of C by body axis, b by
/// chip axis.
Table CorrectionTable(const TriadCalibration& sensor, Triad triad);

/// Gravity, field and temperature, and the source of each value.
Table ReferenceTable(const ReferenceValues& reference, const NamedCovariance& covariance);

}  // namespace truetriad
