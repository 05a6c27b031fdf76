// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "report/table.h"
#include "truetriad/base/triad.h"
#include "truetriad/model/calibration.h"
#include "truetriad/report/report.h"

namespace truetriad {

// What a calibration report says and in which order, once for the terminal and for HTML.

struct Verdict {
  Grade grade = Grade::kBad;
  std::string headline;     ///< "USABLE, within limits".
  std::string explanation;  ///< One sentence.
};
Verdict VerdictOf(const Calibration& calibration);

/// A title inside a section.
struct Subtitle {
  std::string text;
};
/// One point of a list.
struct Bullet {
  std::string text;
  std::string tag = {};  ///< Shown small behind it: "warning, clock-offset".
};
/// A paragraph, a subtitle, a list point or a table.
using Block = std::variant<std::string, Subtitle, Bullet, Table>;

/// A part of a page. Without a title it belongs to the head.
struct PageSection {
  std::string title;
  std::vector<Block> blocks;
  std::vector<Drawing> drawings = {};
};
/// What a verb says, once for the terminal and for HTML.
struct PageContent {
  std::string title;
  Verdict verdict;
  std::vector<PageSection> sections;
};

/// What a section is about, so that HTML can put its figures there.
enum class SectionKind {
  kLimits,
  kFindings,
  kCorrectedError,
  kParameters,
  kSoak,
  kSweep,
  kWeakDirections,
  kModelChoice,
  kHeldOut,
  kResiduals,
  kLeftOut,
  kCoverage,
};

struct Section {
  SectionKind kind = SectionKind::kLimits;
  std::string title;
  std::vector<Block> blocks;
};

/// The sections in reading order: limits, findings, parameters with σ, temperature, weak
/// directions, choice of the model, held-out error, residuals, left-out terms, coverage; one with
/// nothing to say is left out. A calibration that is not usable has no parameters section, whatever
/// numbers it carries.
std::vector<Section> SectionsOf(const Calibration& calibration);

/// Serial, model, software, inputs, gauge: one row each.
Table IdentityTable(const Calibration& calibration);

/// Every triad at every pose.
Table PoseTable(const Quality& quality);

/// "from an Allan deviation".
std::string_view NoiseSourceWords(NoiseSource source);

/// "Accelerometer".
std::string TriadTitle(Triad triad);

/// "0.0912 deg; 0.271 deg with nominal gains …" for errors of turns.
std::string MedianAngles(double median_rad, const std::optional<double>& nominal_rad);

/// The true unit of one triad, for display.
std::string TruthUnit(Triad triad);

}  // namespace truetriad
