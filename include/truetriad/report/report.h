// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "truetriad/base/result.h"
#include "truetriad/calibrate/evaluate.h"
#include "truetriad/data/static_pose.h"
#include "truetriad/model/calibration.h"

namespace truetriad {

struct Plan;

/// How good the result is that a report states. Neutral: it is usable, but there are no limits to
/// meet.
enum class Grade { kGood, kNeutral, kCaution, kBad };
Grade GradeOf(const Calibration& calibration);

/// What a person reads on the terminal after `calibrate`: verdict and limits first, then
/// parameters ± σ, predicted uncertainty, held-out error, residuals, weak directions.
std::string CalibrationText(const Calibration& calibration);

/// A script in a page, and the hash "sha256-…" of its bytes by which the page's policy allows it.
struct EmbeddedScript {
  std::string_view text;
  std::string_view hash;
};

struct ReportLooks {
  /// The folder of report.css and report.js as seen from the page; empty: the page contains them.
  std::string assets = {};
  /// Plotly with `scatter3d` traces, with which spheres can be turned; empty: they cannot. Used
  /// only if `assets` is empty.
  EmbeddedScript plots = {};
};

/// A drawing and its caption, for pages only. Both are empty if there is nothing to show.
struct Drawing {
  std::string svg;
  std::string caption;
  std::string sensor = {};  ///< The drawing's pose marks link to this sensor's rows.
  std::string scene = {};   ///< JSON from which a script draws; empty: none.
};

/// What a page shows in addition to a calibration file; each member may be missing.
struct ReportSources {
  const PoseSet* poses = nullptr;  ///< The input: the recording over time.
  std::vector<Drawing> noise;      ///< Drawings of the recording at rest that shows the noise.
  /// An earlier page of the same calibration, or empty. If the page shows sources, its drawings are
  /// copied.
  std::string_view earlier_page = {};
};

/// One self-contained HTML page (inline CSS, SVG and script, no network; complete without its
/// script) in the order of CalibrationText. The same input gives the same bytes.
std::string CalibrationHtml(const Calibration& calibration,
                            const ReportLooks& looks = {},
                            const ReportSources& sources = {});
/// report.css and report.js, for files that many pages share.
std::string ReportStyleSheet();
std::string ReportScript();

/// "cal.yaml: unit A17, calibrated 2026-01-31T12:00:00Z"; parts that the file does not state are
/// left out.
std::string OriginOf(const std::string& file, const Calibration& calibration);

/// The report of other verbs: as terminal text, and as a page like that of a calibration.
struct VerbReport {
  Grade grade = Grade::kBad;
  std::string text;
  std::string html;
};

/// Report of `inspect`: rates, gaps, poses found, coverage, noise, temperature range. `tried`: the
/// calibration with defaults, or the error why there is none.
VerbReport ReportOf(const PoseSet& poses, const Result<Calibration>& tried);

/// `about`: what was compared with what, one sentence each.
VerbReport ReportOf(const EvaluationSummary& evaluation,
                    const Calibration& calibration,
                    const std::vector<std::string>& about = {});
VerbReport ReportOf(const SideBySide& both, const std::vector<std::string>& about = {});
VerbReport ReportOf(const Comparison& comparison, const std::vector<std::string>& about = {});

/// The verdict, the poses in their order, σ of every quantity before and after, the goals, what the
/// poses cannot observe, and the comparison with random poses. The page, for the person who takes
/// the poses, adds a picture of the cube for each.
VerbReport ReportOf(const Plan& plan);

}  // namespace truetriad
