#include "harness/report/page_frame.h"

#include <fmt/format.h>

#include <cmath>

#include "harness/report/page_assets.h"
#include "harness/report/page_plots.h"

namespace dexcheck {
namespace {

constexpr const char* kContentPolicy =
    "default-src 'none'; img-src data:; media-src data:; style-src 'unsafe-inline'; script-src "
    "'unsafe-inline'";

std::string EscapeTitle(const std::string& text) {
  std::string escaped;
  for (const char c : text) escaped += c == '&' ? "&amp;" : c == '<' ? "&lt;" : std::string(1, c);
  return escaped;
}

}  // namespace

std::string AssemblePage(const PageParts& parts) {
  std::string page = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n";
  if (parts.renew > 0.0)
    page += fmt::format("<meta http-equiv=\"refresh\" content=\"{:.0f}\">\n", std::ceil(parts.renew));
  page += fmt::format(
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"{}\">\n<title>{} – dexcheck</title>\n"
      "<link rel=\"icon\" href=\"data:,\">\n<style>\n{}{}</style>\n</head>\n<body>\n",
      kContentPolicy, EscapeTitle(parts.title), kPageCss, fmt::join(parts.styles, ""));
  page += fmt::format("{}{}", fmt::join(parts.markup, ""), parts.data);
  page += fmt::format("<script>\n{}\n</script>\n", kDomJs);
  for (const char* script : parts.scripts) page += fmt::format("<script>\n{}\n</script>\n", script);
  return page + "</body>\n</html>\n";
}

std::string AssemblePlotPage(const std::string& title, const char* script, const std::string& data,
                             const std::vector<Figure>& figures, const VectorXd& time,
                             const ReplayData* replay) {
  PageParts parts{.title = title,
                  .styles = {kDygraphCss},
                  .markup = {kPageHtml},
                  .data = data + EmbedPlots(figures, time),
                  .scripts = {script, kDygraphJs, kPageJs}};
  if (replay != nullptr) {
    parts.markup.push_back(kReplayHtml);
    parts.data += EmbedJson("replay-scene", replay->json) + EmbedBytes("replay-values", replay->values);
    parts.scripts.insert(parts.scripts.end(), {kThreeJs, kReplayJs});
  }
  return AssemblePage(parts);
}

}  // namespace dexcheck
