#include "harness/report/page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <system_error>

#include "controller/common/errors.h"
#include "harness/base/files.h"
#include "harness/report/html.h"
#include "harness/report/page_frame.h"

namespace dexcheck {
namespace {

constexpr std::uintmax_t kLargestEmbeddedVideo = 20'000'000;  // bytes

/// The verdict in the words of the page.
struct Headline {
  const char* tone;  ///< CSS class.
  std::string word;
  std::string sentence;
};

Headline FindHeadline(const RunData& run) {
  if (run.is_cut_off()) {
    return {
        "open", "NO VERDICT",
        fmt::format("The run was cut off after {:.3f} s; what was recorded until then is below.", run.end())};
  }
  const std::string verdict = run.FindSummaryText("/verdict");
  if (verdict == "failed")
    return {"fail", "FAILED", "The run could not be completed: " + run.FindSummaryText("/failure")};
  if (verdict == "disagreement") {
    const std::string cause = run.FindSummaryText("/attribution/cause");
    return {"fail", "DISAGREEMENT",
            cause == "model"         ? "The two descriptions of the robot differ."
            : cause == "control law" ? "The torques are not those of the law, or do not do what is expected."
                                     : "The engine does not do what the equations say."};
  }
  if (run.checks().empty()) return {"open", "NOT CHECKED", "The run completed; nothing was checked."};
  return {"pass", "PASS", "Model, law, inverse and forward dynamics, assumptions hold at every step."};
}

/// What a category compares, in a few words.
const char* Explain(CheckCategory category, bool moves_joints) {
  switch (category) {
    case CheckCategory::kModel:
      return "same state, both descriptions";
    case CheckCategory::kLaw:
      return moves_joints ? "torques against the law of the joints" : "torques against (53)-(55)";
    case CheckCategory::kInverseDynamics:
      return "engine's motion in the model's equations";
    case CheckCategory::kForwardDynamics:
      return moves_joints ? "accelerations" : "accelerations and contact forces";
    case CheckCategory::kAssumption:
      return moves_joints ? "joints within their ranges, motors within their limits, bodies apart"
                          : "no slip, level base, forces in cones";
  }
  return "";
}

/// A category with its checks, in words.
struct Section {
  CategoryStatus status;
  std::vector<const CheckRecord*> checks;
  const char* tone = "open";  ///< CSS class.
  std::string word = "not asked";
  std::string extent;  ///< "3 checks, at most 40 % of a bound".
};

Section MakeSection(CheckCategory category, const RunData& run) {
  Section section;
  CategoryStatus& status = section.status;
  status.category = category;
  for (const CheckRecord& check : run.checks()) {
    if (check.kind != category) continue;
    section.checks.push_back(&check);
    status.Add(check.name, check.worst, check.bound, check.failed);
  }
  if (!status.is_asked()) return section;
  section.tone = status.failed > 0 ? "fail" : "pass";
  section.word = status.failed > 0 ? fmt::format("{} of {} fail", status.failed, status.checks) : "holds";
  section.extent = fmt::format("{} check{}, at most {} of a bound", status.checks,
                               status.checks == 1 ? "" : "s", FormatFraction(status.fraction()));
  return section;
}

/// A button that brings the page to a time. @param words before the time.
Html MakeTimeButton(const char* style, const std::string& words, double time) {
  return FormatHtml("<button type=\"button\" class=\"{}\" data-time=\"{:.6f}\">{} {:.3f} s</button>", style,
                    time, words, time);
}

/// A value with its unit; 0 has none.
std::string FormatWithUnit(double value, const std::string& unit) {
  return FormatShort(value) + (unit == "1" || value == 0.0 ? "" : " " + unit);
}

class Page : public PageBuilder {
 public:
  Page(const RunData& run, const PageContent& content) : run_(run), content_(content) {
    for (const CheckCategory category : kCheckCategories) sections_.push_back(MakeSection(category, run));
  }

  std::string Make() {
    html_ += BeginPlotPage(fmt::format("{}: {}", FindHeadline(run_).word, Text("scenario")));
    AddVerdict();
    AddNavigation();
    html_ += "<main>\n";
    if (content_.scene.replay) html_ += MakeReplaySection();
    AddVideo();
    AddPictures();
    html_ += MakePlotSection(content_.figures);
    AddChecks();
    AddInputs();
    html_ += "</main>\n";
    Add("<footer>Made by dexcheck {} from the run's log, which holds every number, and the inputs to repeat "
        "the run bit for bit: <code>dexcheck run --replay RUN_DIR</code>. Plots by dygraphs, replay by "
        "three.js (copyright 2010-2019 three.js authors; both MIT license).</footer>\n",
        Text("dexcheck_version"));
    html_ +=
        EndPage(content_.figures, run_.time(), content_.scene.replay ? &*content_.scene.replay : nullptr);
    return html_.markup();
  }

 private:
  std::string Text(const char* name) const { return run_.FindText(name); }

  void AddVerdict() {
    const Headline headline = FindHeadline(run_);
    const std::string description = run_.FindSummaryText("/description");
    Add("<header>\n<h1><b>{}</b>{}{}</h1>\n<section class=\"verdict {}\" id=\"verdict\"><strong>{}</strong>"
        "<p>{}</p>",
        Text("scenario"), description.empty() ? "" : " – ", description, headline.tone, headline.word,
        headline.sentence);
    const std::string cause = run_.FindSummaryText("/attribution/cause");
    if (!cause.empty() && cause != "none") {
      Add("<p>Cause: <b>{}</b>. Evidence: {}.</p>", cause, run_.FindSummaryText("/attribution/evidence"));
    }
    if (const CheckRecord* const first = FindFirstFailure()) {
      Add("<p>{}</p>", MakeTimeButton("", "See it: " + first->name + " fails from", first->failed_at));
    }
    if (run_.summary().value("interrupted", false))
      Add("<p>The run was stopped by hand after {:.3f} s.</p>", run_.end());
    html_ += "</section>\n";
    AddCategories();
    AddTiles();
    html_ += "</header>\n";
  }

  /// The check that failed first in time; null when none did in the run.
  [[nodiscard]] const CheckRecord* FindFirstFailure() const {
    const CheckRecord* first = nullptr;
    for (const CheckRecord& check : run_.checks()) {
      if (!check.failed || !IsTimed(check)) continue;
      if (first == nullptr || check.failed_at < first->failed_at) first = &check;
    }
    return first;
  }

  [[nodiscard]] const char* Explain(const Section& section) const {
    return dexcheck::Explain(section.status.category, run_.moves_joints());
  }

  void AddCategories() {
    if (run_.checks().empty()) return;
    html_ += "<div class=\"tiles\">\n";
    for (const Section& section : sections_) {
      const Html link = section.checks.empty()
                            ? Html()
                            : FormatHtml(" href=\"#checks-{}\"", NameOf(section.status.category));
      Add("<a class=\"card category {}\"{}><b>{}: {}</b><span>{}</span><span>{}</span></a>\n", section.tone,
          link, TitleOf(section.status.category), section.word, Explain(section), section.extent);
    }
    html_ += "</div>\n";
  }

  void AddTile(const std::string& value, const std::string& label) {
    Add("<div class=\"card\"><b>{}</b><span>{}</span></div>\n", value, label);
  }

  void AddTiles() {
    html_ += "<div class=\"tiles\">\n";
    const auto add_error = [&](const char* pointer, const char* unit, const char* label) {
      const double value = run_.FindSummaryNumber(pointer);
      AddTile(std::isfinite(value) ? FormatShort(value) + unit : std::string("–"), label);
    };
    if (std::isfinite(run_.FindSummaryNumber("/tracking/joint_error_max_rad"))) {
      add_error("/tracking/joint_error_max_rad", " rad", "largest error of a joint");
    } else {
      add_error("/tracking/position_error_max_m", " m", "largest position error of the object");
      add_error("/tracking/orientation_error_max_rad", " rad", "largest orientation error");
    }
    const double simulated = run_.FindSummaryNumber("/simulated_s");
    AddTile(fmt::format("{:.4g} s", std::isfinite(simulated) ? simulated : run_.end()),
            fmt::format("simulated, {} steps", run_.time().size()));
    for (const CheckRecord& check : run_.checks()) {
      if (check.name == "cone_use")
        AddTile(FormatFraction(check.worst), "of the fingertips' friction used, at most");
    }
    // By class of bodies that are not meant to touch.
    for (const auto& [pairs, nearest] : run_.summary().value("clearance", nlohmann::json::object()).items()) {
      std::string name = pairs;
      std::replace(name.begin(), name.end(), '_', ' ');
      AddTile(fmt::format("{:.1f} mm", 1e3 * nearest.value("smallest_m", std::nan(""))),
              fmt::format("{}: nearest are {}", name, nearest.value("bodies", "")));
    }
    const double factor = run_.FindSummaryNumber("/speed/real_time_factor");
    if (std::isfinite(factor)) AddTile(fmt::format("{:.2g} ×", factor), "real time");
    html_ += "</div>\n";
  }

  void AddNavigation() {
    std::vector<std::string> sections = {"Verdict"};
    if (content_.scene.replay) sections.emplace_back("Replay");
    if (!content_.video.empty()) sections.emplace_back("Video");
    if (!content_.scene.pictures.empty()) sections.emplace_back("Pictures");
    sections.emplace_back("Plots");
    if (!run_.checks().empty()) sections.emplace_back("Checks");
    sections.emplace_back("Inputs");
    html_ += MakeNavigation(sections);
  }

  void AddCheckRow(const CheckRecord& check) {
    const double fraction = CalcFraction(check);
    std::string where = check.part;
    if (IsTimed(check)) where += fmt::format("{}{:.3f} s", where.empty() ? "" : ", ", check.at);
    const Html verdict =
        !check.failed || !IsTimed(check)
            ? FormatHtml("<span class=\"badge\">{}</span>", check.failed ? "differs" : "holds")
            : MakeTimeButton("badge", "fails from", check.failed_at);
    const std::string cause = run_.FindSummaryText(("/attribution/checks/" + check.name).c_str());
    Add("<tr class=\"{}\"><td><code>{}</code><small>{}</small></td><td>{}{}</td><td class=\"value number\" "
        "data-label=\"worst\">{}</td><td class=\"value number\" data-label=\"bound\">{}</td>"
        "<td data-label=\"of bound\"><span class=\"number\">{}</span><span class=\"meter\"><i "
        "style=\"width:{:.1f}%\"></i></span></td><td class=\"where\" data-label=\"{}\"><small>{}</small></td>"
        "</tr>\n",
        check.failed ? "fail" : "pass", check.name, check.description, verdict,
        cause.empty() || !check.failed ? Html() : FormatHtml("<small>cause: {}</small>", cause),
        FormatWithUnit(check.worst, check.unit), FormatWithUnit(check.bound, check.unit),
        FormatFraction(fraction), 100.0 * std::clamp(std::isfinite(fraction) ? fraction : 1.0, 0.0, 1.0),
        where.empty() ? "" : "at", where);
  }

  void AddCheckTable(const std::vector<const CheckRecord*>& checks) {
    html_ +=
        "<table class=\"checks\"><thead><tr><th>check</th><th>verdict</th><th class=\"value\">worst</th>"
        "<th class=\"value\">bound</th><th>of bound</th><th>where, when</th></tr></thead><tbody>\n";
    for (const CheckRecord* check : checks) AddCheckRow(*check);
    html_ += "</tbody></table>\n";
  }

  /// The checks of a category, folded unless one fails.
  void AddSection(const Section& section) {
    std::vector<const CheckRecord*> shown;
    std::vector<const CheckRecord*> equal_constants;
    for (const CheckRecord* check : section.checks) {
      (!IsTimed(*check) && !check->failed ? equal_constants : shown).push_back(check);
    }
    const CheckCategory category = section.status.category;
    Add("<details class=\"answer {}\" id=\"checks-{}\"{}><summary><b>{}</b> <span class=\"badge\">{}</span> "
        "{}: {}</summary>\n",
        section.tone, NameOf(category), section.status.failed > 0 ? " open" : "", TitleOf(category),
        section.word, Explain(section), section.extent);
    if (!shown.empty()) AddCheckTable(shown);
    if (!equal_constants.empty()) {
      Add("<details><summary>{} constants of both descriptions agree</summary>\n", equal_constants.size());
      AddCheckTable(equal_constants);
      html_ += "</details>\n";
    }
    html_ += "</details>\n";
  }

  void AddChecks() {
    if (run_.checks().empty()) return;
    html_ +=
        "<h2 id=\"checks\">Checks</h2>\n<p class=\"soft\">What failed first, then by fraction of the bound. "
        "A bound is what rounding, or the tolerance of the assumption, can explain.</p>\n"
        "<div class=\"card\">\n";
    for (const Section& section : sections_) {
      if (!section.checks.empty()) AddSection(section);
    }
    html_ += "</div>\n";
  }

  void AddVideo() {
    if (content_.video.empty()) return;
    html_ += "<h2 id=\"video\">Video</h2>\n";
    std::error_code error;
    if (std::filesystem::file_size(content_.video, error) > kLargestEmbeddedVideo || error) {
      Add("<p><a href=\"{}\">{}</a> (too large to be part of this page)</p>\n", content_.video_link,
          content_.video.filename().string());
      return;
    }
    Add("<video controls playsinline preload=\"metadata\" src=\"data:video/mp4;base64,{}\"></video>\n",
        EncodeBase64(ReadBytes(content_.video)));
  }

  void AddPictures() {
    if (content_.scene.pictures.empty()) return;
    html_ += "<h2 id=\"pictures\">Pictures</h2>\n<div class=\"grid\">\n";
    for (const Picture& picture : content_.scene.pictures) {
      Add("<figure class=\"card\"><figcaption>{}{}</figcaption><img alt=\"{}\" "
          "src=\"data:image/png;base64,{}\"></figure>\n",
          picture.panel.empty() ? Html() : FormatHtml("<b>Figure {}</b>", picture.panel), picture.title,
          picture.title, EncodeBase64(ReadBytes(picture.file)));
    }
    html_ += "</div>\n";
  }

  void AddFile(const std::string& name, const std::string& title, bool open) {
    const std::vector<std::string> files = run_.log().ListFiles("inputs");
    if (std::find(files.begin(), files.end(), name) == files.end()) return;
    Add("<details{}><summary>{}</summary><pre tabindex=\"0\">{}</pre></details>\n", open ? " open" : "",
        title, run_.log().ReadFile("inputs", name));
  }

  void AddInputs() {
    html_ += "<h2 id=\"inputs\">Inputs</h2>\n<div class=\"card\">\n<dl>\n";
    const auto add = [&](const char* term, const Html& value) {
      if (!value.empty()) Add("<dt>{}</dt><dd>{}</dd>\n", term, value);
    };
    const std::string command = Text("command");
    add("Command", command.empty() ? Html() : FormatHtml("<code>{}</code>", command));
    Html overrides;
    std::istringstream lines(Text("overrides"));
    for (std::string line; std::getline(lines, line);) {
      overrides += FormatHtml("{}{}", overrides.empty() ? Html() : Html("<br>"), line);
    }
    add("Overrides", overrides.empty() ? Html("none") : FormatHtml("<code>{}</code>", overrides));
    constexpr std::array<std::array<const char*, 2>, 6> kTexts = {{{"Seed", "seed"},
                                                                   {"Model", "robot"},
                                                                   {"MJCF", "mjcf"},
                                                                   {"dexcheck", "dexcheck_version"},
                                                                   {"MuJoCo", "mujoco_version"},
                                                                   {"Machine", "machine"}}};
    for (const auto& [term, name] : kTexts) add(term, Html::Text(Text(name)));
    html_ += "</dl>\n";
    AddFile("scenario.toml", "Scenario", true);
    AddFile("robot/" + Text("robot"), "Parameters of the model: " + Text("robot"), false);
    AddFile("mjcf/" + Text("mjcf"), "MJCF: " + Text("mjcf"), false);
    html_ += "</div>\n";
  }

  const RunData& run_;
  const PageContent& content_;
  std::vector<Section> sections_;
};

}  // namespace

std::string MakePage(const RunData& run, const PageContent& content) {
  try {
    return Page(run, content).Make();
  } catch (const nlohmann::json::exception& error) {
    throw InputError(run.log().path().string() + ": summary: " + error.what());
  }
}

}  // namespace dexcheck
