// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "report/content.h"
#include "report/table.h"
#include "truetriad/report/report.h"

namespace truetriad {

// How a report looks on the terminal and as a self-contained HTML page, whatever it is about.

/// Verdict and sections.
VerbReport ReportOf(const PageContent& content);

std::string TextOf(const Headline& headline);
std::string TextOf(const std::vector<Section>& sections);
std::string HtmlOf(const std::vector<Section>& sections);

/// `content`, escaped, in an element.
std::string Element(std::string_view tag, std::string_view content);

std::string HtmlOf(const Table& table);

/// Blocks in order, neighbouring list points in one list.
std::string HtmlOf(const std::vector<Block>& blocks);

/// Hidden until it is opened.
std::string Details(std::string_view summary, const std::string& html);

/// Where a page has its looks from.
struct PageLooks {
  std::string_view style = {};   ///< Rules of its own.
  std::string_view assets = {};  ///< Of ReportLooks; then `style` is not in the page.
  /// In order; with `assets` ReportScript alone, from there.
  std::vector<EmbeddedScript> scripts = {};
};

/// The page: title, verdict, then `body`.
std::string HtmlPage(std::string_view title,
                     const Headline& headline,
                     const std::string& body,
                     const PageLooks& looks = {});

// What is in src/report/assets.

/// report.css.
std::string_view PageStyle();
/// report.js.
EmbeddedScript PageScript();
/// sphere.js, which needs Plotly before it.
EmbeddedScript SphereScript();

}  // namespace truetriad
