// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/calibrate/compare.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/calibrate/side_by_side.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

struct Plan;

/// How good the news is that a text begins with; neutral: usable, but nothing was asked of it.
enum class Grade { kGood, kNeutral, kCaution, kBad };
Grade GradeOf(const Calibration& calibration);

/// What a person reads on the terminal after `calibrate`: verdict and limits first, then
/// parameters ± σ, predicted uncertainty, held-out error, residuals, weak directions.
std::string CalibrationText(const Calibration& calibration);

/// A script that stands in a page, and what the page's policy allows it by: "sha256-…" of its
/// bytes.
struct EmbeddedScript {
  std::string_view text;
  std::string_view hash;
};

struct ReportLooks {
  /// The folder in which report.css and report.js are, as seen from the page; empty: they are in
  /// it.
  std::string assets = {};
  /// Plotly with traces `scatter3d`, for what turns; empty: nothing does. Only without `assets`.
  EmbeddedScript plots = {};
};

/// A drawing and what it shows; on pages alone. Nothing where it is empty.
struct Drawing {
  std::string svg;
  std::string caption;
  std::string sensor = {};  ///< To whose rows its marks of poses lead.
  std::string scene = {};   ///< What a script draws in its place, as JSON; empty: nothing.
};

/// What a page shows beyond what a calibration file holds; each may be missing.
struct ReportSources {
  const PoseSet* poses = nullptr;  ///< From what it was calibrated: the recording over time.
  std::vector<Drawing> noise;      ///< From where the noise at rest was taken.
  /// A page of the same calibration, of which what these would show is taken over; may be empty.
  std::string_view earlier_page = {};
};

/// One self-contained HTML page (inline CSS, SVG and script, no network; whole without its script):
/// the same order. Same input, same bytes.
std::string CalibrationHtml(const Calibration& calibration,
                            const ReportLooks& looks = {},
                            const ReportSources& sources = {});
/// report.css and report.js, for files that many pages share.
std::string ReportStyleSheet();
std::string ReportScript();

/// "cal.yaml: unit A17, calibrated 2026-01-31T12:00:00Z", what it has of that.
std::string OriginOf(const std::string& file, const Calibration& calibration);

/// What other verbs say: on the terminal, and as a page like that of a calibration.
struct VerbReport {
  Grade grade = Grade::kBad;
  std::string text;
  std::string html;
};

/// Of `inspect`: rates, gaps, poses found, coverage, noise, temperature range. `tried`: what a
/// calibration with defaults makes of it, or why there is none.
VerbReport ReportOf(const PoseSet& poses, const Result<Calibration>& tried);

/// `about`: what was compared with what, a sentence each.
VerbReport ReportOf(const EvaluationSummary& evaluation,
                    const Calibration& calibration,
                    const std::vector<std::string>& about = {});
VerbReport ReportOf(const SideBySide& both, const std::vector<std::string>& about = {});
VerbReport ReportOf(const Comparison& comparison, const std::vector<std::string>& about = {});

/// The verdict, the poses in their order, σ of every quantity before and after, what was wanted,
/// what the poses cannot see, and the comparison with random poses. The page is for the person who
/// takes the poses: a picture of the cube for each, then the same tables.
VerbReport ReportOf(const Plan& plan);

}  // namespace truetriad
