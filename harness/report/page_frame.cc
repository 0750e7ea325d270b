#include "harness/report/page_frame.h"

#include <cctype>
#include <cmath>

#include "harness/report/page_assets.h"
#include "harness/report/page_plots.h"

namespace dexcheck {
namespace {

constexpr const char* kContentPolicy =
    "default-src 'none'; img-src data:; media-src data:; style-src 'unsafe-inline'; script-src "
    "'unsafe-inline'";

}  // namespace

Html BeginPage(const std::string& title, const Html& style, double renew) {
  Html html("<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n");
  if (renew > 0.0) html += FormatHtml("<meta http-equiv=\"refresh\" content=\"{:.0f}\">\n", std::ceil(renew));
  html += FormatHtml(
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">\n<title>{} – dexcheck</title>\n"
      "<link rel=\"icon\" href=\"data:,\">\n<style>\n{}{}</style>\n</head>\n<body>\n",
      kContentPolicy, title, Html::Raw(kPageCss), style);
  return html;
}

Html BeginPlotPage(const std::string& title) { return BeginPage(title, Html::Raw(kDygraphCss)); }

Html MakeNavigation(const std::vector<std::string>& sections) {
  Html links;
  for (const std::string& section : sections) {
    std::string id = section;
    id[0] = static_cast<char>(std::tolower(static_cast<unsigned char>(id[0])));
    links += FormatHtml("<a href=\"#{}\">{}</a>", id, section);
  }
  return FormatHtml("<nav><div>{}</div></nav>\n", links);
}

Html MakePlotSection(const std::vector<Figure>& figures) {
  Html html;
  html +=
      "<section id=\"plots\"><h2>Plots</h2>\n<div class=\"tools\"><button id=\"show-all\" "
      "type=\"button\">Show the whole run</button><span class=\"soft\">Drag to zoom (all plots follow), "
      "Shift-drag to move, double-click for the whole run; on a touch screen use two fingers. Names switch "
      "curves on and off.</span></div>\n<div class=\"grid\">\n";
  for (size_t i = 0; i < figures.size(); ++i) {
    const Figure& figure = figures[i];
    html += FormatHtml(
        "<section class=\"card\" data-plot=\"{}\"><h3>{} {}<span class=\"soft number time\"></span></h3>"
        "<div class=\"keys\"></div><div class=\"plot\"></div>{}</section>\n",
        i, figure.title,
        figure.panel.empty() ? Html() : FormatHtml("<span class=\"panel\">Figure {}</span> ", figure.panel),
        figure.note.empty() ? Html() : FormatHtml("<p class=\"soft\"><small>{}</small></p>", figure.note));
  }
  html += "</div></section>\n";
  return html;
}

Html MakeReplaySection() { return Html::Raw(kReplayHtml); }

Html EndPage(const std::vector<Figure>& figures, const VectorXd& time, const ReplayData* replay) {
  Html html = EmbedPlots(figures, time);
  html += FormatHtml("<script>\n{}\n</script>\n<script>\n{}</script>\n", Html::Raw(kDygraphJs),
                     Html::Raw(kPageJs));
  if (replay != nullptr) {
    html += EmbedJson("replay-scene", replay->json);
    html += EmbedBytes("replay-values", replay->values);
    html += FormatHtml("<script>\n{}\n</script>\n<script>\n{}</script>\n", Html::Raw(kThreeJs),
                       Html::Raw(kReplayJs));
  }
  html += "</body>\n</html>\n";
  return html;
}

}  // namespace dexcheck
