// SPDX-License-Identifier: Apache-2.0
#include "report/page.h"

#include <cctype>
#include <cstddef>
#include <type_traits>
#include <variant>

#include "report/chart_frame.h"
#include "report/pose_picture.h"
#include "report/svg.h"

namespace truetriad {
namespace {

constexpr std::string_view kStyle = R"css(
:root{--ink:#1c2430;--soft:#5b6675;--line:#dde2e8;--good:#1a7f37;--caution:#9a6700;--bad:#c62828;--blue:#1f5fbf}
*{box-sizing:border-box}
body{margin:0;background:#f4f6f8;color:var(--ink);font:15px/1.5 system-ui,"Segoe UI",Roboto,"Helvetica Neue",Arial,sans-serif}
main{max-width:60rem;margin:1.5rem auto;padding:2rem 2.5rem;background:#fff;border:1px solid var(--line);border-radius:6px}
h1{font-size:1.5rem;margin:0 0 .2rem}h2{font-size:1.1rem;margin:2.2rem 0 .6rem;padding-bottom:.3rem;border-bottom:1px solid var(--line)}
h3{font-size:1rem;margin:1.4rem 0 .4rem}p{margin:.5rem 0;max-width:48rem}
.verdict{margin:1rem 0;padding:.8rem 1.1rem;border-left:6px solid;border-radius:4px}
.verdict b{display:block;font-size:1.25rem;letter-spacing:.01em}.verdict span{color:var(--ink)}
.good{color:var(--good);background:#eaf6ed}.neutral{color:var(--blue);background:#eaf1fb}.caution{color:var(--caution);background:#fdf5e0}.bad{color:var(--bad);background:#fdecec}
.scroll{overflow-x:auto}table{border-collapse:collapse;margin:.5rem 0;font-size:.9rem;font-variant-numeric:tabular-nums}
th,td{padding:.25rem .8rem .25rem 0;text-align:left;vertical-align:top;border-bottom:1px solid #edf0f3}
th{font-weight:600;color:var(--soft);border-bottom-color:var(--line)}td.r,th.r{text-align:right;white-space:nowrap;padding-left:.6rem}
td:first-child{white-space:nowrap}td.fail{color:var(--bad);font-weight:600}td.pass{color:var(--good)}
.identity{color:var(--soft)}.identity td{border:0;padding-top:.05rem;padding-bottom:.05rem}.identity td+td{color:var(--ink);overflow-wrap:anywhere}
ul{padding-left:1.2rem;margin:.5rem 0}li{margin:.2rem 0}li small{color:var(--soft);white-space:nowrap}
figure{margin:1rem 0}figcaption{color:var(--soft);font-size:.85rem;max-width:48rem}
details{margin:1rem 0}summary{cursor:pointer;color:var(--blue)}pre{overflow-x:auto;padding:.8rem;background:#f4f6f8;border-radius:4px;font-size:.8rem}
svg{display:block;width:100%;height:auto;font:11px system-ui,"Segoe UI",Roboto,Arial,sans-serif}
svg text{fill:var(--soft)}svg .start{text-anchor:start}svg .middle{text-anchor:middle}svg .end{text-anchor:end}
svg .title{font-weight:600;fill:var(--ink)}svg .small{font-size:10px}
svg .frame,svg .disc{fill:none;stroke:#aeb7c2}svg .disc{fill:#fafbfc}svg .ring,svg .grid{fill:none;stroke:#e3e7ec}svg .zero{stroke:#8b95a3}
svg .band{fill:#e3edfb}svg .after{fill:var(--blue);fill-opacity:.8}svg .before{fill:#8b95a3}svg .rejected{stroke:var(--bad);stroke-width:2}
svg .dots{fill:none;stroke:var(--blue);stroke-width:3.6;stroke-linecap:round;stroke-opacity:.75}svg .raw{stroke:#d9730d}svg .warming{stroke:#d9730d;stroke-width:2.4}svg .cooling{stroke-width:2.4}
svg .hole{fill:#f7dcb9}svg .next{fill:none;stroke:#d9730d;stroke-width:2.5}svg .line{fill:none;stroke:#d9730d;stroke-width:1.6}
svg .track{fill:#eef1f4}svg .pass{fill:#7fbf90}svg .fail{fill:#e08585}svg .whisker{stroke:var(--ink);stroke-width:2}svg .limit{stroke:var(--ink);stroke-dasharray:3 2}
.drawings{display:grid;gap:0 1.5rem}
@media(max-width:40rem){main{margin:0;padding:1rem;border:0}td.r,th.r{white-space:normal;padding-left:.2rem}th,td{padding-right:.2rem}table{font-size:.72rem}td:first-child{white-space:normal}}
@media print{@page{margin:12mm 11mm 14mm}:root{font-size:10.5px}body{background:#fff;font-size:1rem;line-height:1.3}main{margin:0;padding:0;border:0;max-width:none}
h2{margin:1rem 0 .3rem}h3{margin:.7rem 0 .2rem}h2,h3{break-after:avoid}figure,tr{break-inside:avoid}figure{margin:.4rem 0}p{max-width:none;margin:.25rem 0}
.verdict{padding:.4rem .8rem;margin:.5rem 0}.scroll{overflow:visible}table{margin:.2rem 0}td,th{padding:.1rem .5rem .1rem 0}td.r,th.r{padding-left:.3rem;white-space:normal}
.drawings{grid-template-columns:1fr 1fr}.screen{display:none}
*{print-color-adjust:exact;-webkit-print-color-adjust:exact}}
)css";

std::string Underlined(const std::string& title) {
  return '\n' + title + '\n' + std::string(DisplayWidth(title), '-') + '\n';
}

std::string TextOfBlock(const Block& block) {
  return std::visit(
      [](const auto& content) -> std::string {
        using Content = std::decay_t<decltype(content)>;
        if constexpr (std::is_same_v<Content, Table>) return TextOf(content);
        if constexpr (std::is_same_v<Content, std::string>) return Wrapped(content);
        if constexpr (std::is_same_v<Content, Bullet>) {
          const std::string tag = content.tag.empty() ? "" : " [" + content.tag + "]";
          return Wrapped(content.text + tag, 2, "- ");
        }
        if constexpr (std::is_same_v<Content, Subtitle>) return "\n  " + content.text + '\n';
      },
      block);
}

std::string HtmlOfBlock(const Block& block) {
  return std::visit(
      [](const auto& content) -> std::string {
        using Content = std::decay_t<decltype(content)>;
        if constexpr (std::is_same_v<Content, Table>) return HtmlOf(content);
        if constexpr (std::is_same_v<Content, std::string>) return Element("p", content);
        if constexpr (std::is_same_v<Content, Bullet>) {
          if (content.tag.empty()) return Element("li", content.text);
          return "<li>" + EscapeMarkup(content.text) + " <small>" + EscapeMarkup(content.tag) +
                 "</small></li>\n";
        }
        if constexpr (std::is_same_v<Content, Subtitle>) return Element("h3", content.text);
      },
      block);
}

std::string_view CssClass(Grade grade) {
  switch (grade) {
    case Grade::kGood:
      return "good";
    case Grade::kNeutral:
      return "neutral";
    case Grade::kCaution:
      return "caution";
    case Grade::kBad:
      break;
  }
  return "bad";
}

/// Whose page it is and which, below each printed one.
std::string PageFoot(std::string_view title) {
  // In a style, whatever is no letter or digit is written by its number.
  std::string text;
  for (const char c : title) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x80 || std::isalnum(byte) != 0 || c == ' ') {
      text += c;
      continue;
    }
    constexpr std::string_view kDigits = "0123456789abcdef";
    text += {'\\', '0', '0', '0', '0', kDigits[byte >> 4U], kDigits[byte & 15U]};
  }
  return "@page{@bottom-left{content:\"" + text +
         "\";font:9px sans-serif}@bottom-right{content:counter(page) \" / \" counter(pages);"
         "font:9px sans-serif}}\n";
}

}  // namespace

std::string ReportStyleSheet() {
  return std::string(kStyle.substr(1)) + std::string(kFitStyle) + std::string(PosePictureStyle()) +
         '\n';
}

std::string SectionText(const std::string& title, const std::vector<Block>& blocks) {
  std::string text = Underlined(title);
  for (const Block& block : blocks) text += TextOfBlock(block);
  return text;
}

std::string TextOf(const PageContent& content) {
  std::string text = content.verdict.headline + '\n' + Wrapped(content.verdict.explanation, 0);
  for (const PageSection& section : content.sections) {
    if (!section.title.empty()) text += Underlined(section.title);
    for (const Block& block : section.blocks) text += TextOfBlock(block);
  }
  return text;
}

std::string HtmlOf(const PageContent& content) {
  std::string html;
  for (const PageSection& section : content.sections) {
    html += "<section>\n" + (section.title.empty() ? "" : Element("h2", section.title)) +
            HtmlOf(section.blocks) + "</section>\n";
  }
  return HtmlPage(content.title, content.verdict, html);
}

std::string Element(std::string_view tag, std::string_view content) {
  return '<' + std::string(tag) + '>' + EscapeMarkup(content) + "</" + std::string(tag) + ">\n";
}

std::string HtmlOf(const Table& table, std::string_view css_class) {
  if (table.rows.empty()) return "";
  const auto append_row =
      [&](const std::vector<std::string>& cells, std::string_view tag, std::string* html) {
        *html += "<tr>";
        for (std::size_t c = 0; c < cells.size(); ++c) {
          std::string_view style = table.alignment[c] == 'r' ? "r" : "";
          if (tag == "td" && cells[c] == "FAIL") style = "fail";
          if (tag == "td" && cells[c] == "pass") style = "pass";
          html->append("<").append(tag);
          if (!style.empty()) html->append(" class=\"").append(style).append("\"");
          html->append(">").append(EscapeMarkup(cells[c]));
          html->append("</").append(tag).append(">");
        }
        *html += "</tr>\n";
      };
  std::string html = "<div class=\"scroll\"><table class=\"" + std::string(css_class) + "\">\n";
  if (!table.header.empty()) {
    html += "<thead>";
    append_row(table.header, "th", &html);
    html += "</thead>\n";
  }
  html += "<tbody>\n";
  for (const auto& row : table.rows) append_row(row, "td", &html);
  return html + "</tbody></table></div>\n";
}

std::string HtmlOf(const std::vector<Block>& blocks) {
  std::string html;
  bool in_list = false;
  for (const Block& block : blocks) {
    const bool is_point = std::holds_alternative<Bullet>(block);
    if (is_point != in_list) html += is_point ? "<ul>\n" : "</ul>\n";
    in_list = is_point;
    html += HtmlOfBlock(block);
  }
  return in_list ? html + "</ul>\n" : html;
}

std::string Figure(const std::string& svg, std::string_view caption) {
  if (svg.empty()) return "";
  return "<figure>\n" + svg + Element("figcaption", caption) + "</figure>\n";
}

std::string Details(std::string_view summary, const std::string& html) {
  return "<details>\n" + Element("summary", summary) + html + "</details>\n";
}

std::string HtmlPage(std::string_view title,
                     const Verdict& verdict,
                     const std::string& body,
                     std::string_view style,
                     std::string_view style_sheet) {
  const bool is_alone = style_sheet.empty();
  // Drawings say how wide they are in an attribute.
  std::string looks =
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; style-src " +
      std::string(is_alone ? "" : "'self' ") + "'unsafe-inline'; img-src data:\">\n";
  if (!is_alone) {
    looks += "<link rel=\"icon\" href=\"data:,\">\n<link rel=\"stylesheet\" href=\"" +
             EscapeMarkup(style_sheet) + "\">\n";
  }
  looks += "<style>" + (is_alone ? std::string(kStyle) + std::string(style) : std::string()) +
           PageFoot(title) + "</style>\n";
  return "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
         "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n" +
         Element("title", std::string(title) + ": " + verdict.headline) + looks +
         "</head>\n<body>\n<main>\n" + Element("h1", title) + "<div class=\"verdict " +
         std::string(CssClass(verdict.grade)) + "\">" + Element("b", verdict.headline) +
         Element("span", verdict.explanation) + "</div>\n" + body + "</main>\n</body>\n</html>\n";
}

}  // namespace truetriad
