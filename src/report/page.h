// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "report/content.h"
#include "report/table.h"
#include "truetriad/report/report.h"

namespace truetriad {

// The layout of a report on the terminal and as a self-contained HTML page, for any verb.

/// The verdict and the sections of `content` as text and page.
VerbReport ReportOf(const PageContent& content);

std::string TextOf(const Headline& headline);
std::string TextOf(const std::vector<Section>& sections);
std::string HtmlOf(const std::vector<Section>& sections);

/// `content`, escaped, in an element.
std::string Element(std::string_view tag, std::string_view content);

std::string HtmlOf(const Table& table);

/// The blocks in their order; neighbouring list points form one list.
std::string HtmlOf(const std::vector<Block>& blocks);

/// A block that is hidden until the reader opens it.
std::string Details(std::string_view summary, const std::string& html);

/// The style sheets and scripts of a page.
struct PageLooks {
  std::string_view style = {};   ///< The page's own rules, as CSS.
  std::string_view assets = {};  ///< ReportLooks::assets; if set, the page leaves out `style`.
  /// The scripts in the order of the page. If `assets` is set, the page loads only ReportScript,
  /// from that folder.
  std::vector<EmbeddedScript> scripts = {};
};

/// The page: title, verdict, then `body`.
std::string HtmlPage(std::string_view title,
                     const Headline& headline,
                     const std::string& body,
                     const PageLooks& looks = {});

// The files of src/report/assets.

/// The text of report.css.
std::string_view PageStyle();
/// The text of report.js.
EmbeddedScript PageScript();
/// The text of sphere.js, which needs Plotly before it.
EmbeddedScript SphereScript();

}  // namespace truetriad
